# SPDX-License-Identifier: GPL-3.0-or-later
"""Range asymmetric numeral systems on many lanes at once (Duda 2013): symbol i is in lane i modulo the lanes."""

import numpy as np

from ..core.mesh import Ints
from .errors import StreamError
from .models import SCALE, SCALE_BITS

_LEAST = 1 << 16


def lanes_for(symbols: int) -> int:
    """Return how many lanes pay for so many symbols: a power of two from 1 to 512."""
    return 1 << min(max(symbols // 600, 1).bit_length() - 1, 9)


def encode(phases: list[tuple[Ints, Ints]], lanes: int) -> bytes:
    """Write symbols.

    Parameters
    ----------
    phases : list of (frequency, start), each (n,) int64
        Of each symbol, in the order of reading; each phase begins in lane 0.
    lanes : int

    Returns
    -------
    bytes
        The lanes' states, 4 bytes each, then words of 2 bytes in the order of reading.
    """
    state = np.full(lanes, _LEAST, np.int64)
    words: list[np.ndarray] = []
    for frequency, start in reversed(phases):
        limit = frequency << (32 - SCALE_BITS)
        for first in range((len(frequency) - 1) // lanes * lanes, -1, -lanes):
            part = slice(first, first + lanes)
            own = frequency[part]
            active = state[: len(own)]
            full = np.flatnonzero(active >= limit[part])
            if len(full):
                held = active.take(full)
                words.append(held & 0xFFFF)
                active[full] = held >> 16
            quotient, rest = np.divmod(active, own)
            active[:] = (quotient << SCALE_BITS) + rest + start[part]
    body = np.concatenate(words[::-1]) if words else np.zeros(0, np.int64)
    return state.astype("<u4").tobytes() + body.astype("<u2").tobytes()


class RansReader:
    """Reads what `encode` wrote.

    Parameters
    ----------
    data : bytes
    lanes : int
    """

    def __init__(self, data: bytes, lanes: int) -> None:
        if len(data) < 4 * lanes or len(data) % 2:
            raise StreamError("the stream is damaged: a batch is too short; fetch the file again")
        self._state = np.frombuffer(data[: 4 * lanes], "<u4").astype(np.int64)
        self._words = np.frombuffer(data[4 * lanes :], "<u2").astype(np.int64)
        self._position = 0

    def read(self, context: Ints, frequency: Ints, start: Ints) -> Ints:
        """Return the next symbols, one for each context: (n,) int64.

        Parameters
        ----------
        context : ndarray, (n,) int64
        frequency, start : ndarray, (contexts, symbols) int64
        """
        symbols = frequency.shape[1]
        widths = frequency.ravel()
        symbol_of = np.repeat(np.arange(len(widths)), widths)
        width_of = widths.take(symbol_of)
        bias_of = (np.arange(len(symbol_of)) & (SCALE - 1)) - start.ravel().take(symbol_of)
        base = context << SCALE_BITS
        slots = np.zeros(len(context), np.int64)
        state, words, position = self._state, self._words, self._position
        lanes = len(state)
        for first in range(0, len(context), lanes):
            slot = base[first : first + lanes]
            active = state[: len(slot)]
            slot = slot + (active & (SCALE - 1))
            slots[first : first + lanes] = slot
            active = width_of.take(slot) * (active >> SCALE_BITS) + bias_of.take(slot)
            short = (active < _LEAST).nonzero()[0]
            if len(short):
                more = words[position : position + len(short)]
                if len(more) < len(short):
                    raise StreamError("the stream is damaged: a batch ends too early; fetch the file again")
                active[short] = (active.take(short) << 16) | more
                position += len(short)
            state[: len(slot)] = active
        self._position = position
        return symbol_of.take(slots) - context * symbols
