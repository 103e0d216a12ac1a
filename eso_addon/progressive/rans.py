# SPDX-License-Identifier: GPL-3.0-or-later
"""Range asymmetric numeral systems on many lanes at once (Duda 2013): symbol i of a run is in lane i modulo the lanes.

The lanes' states go on from batch to batch, so that a batch costs nothing but its words.
"""

import numpy as np

from ..core.mesh import Ints
from .errors import StreamError
from .models import SCALE, SCALE_BITS

_LEAST = 1 << 16


def lanes_for(places: int) -> int:
    """Return how many lanes pay for a mesh of so many places: a power of two from 4 to 512."""
    return 1 << min(max(places // 256, 4).bit_length() - 1, 9)


def encode(batches: list[list[tuple[Ints, Ints]]], lanes: int) -> tuple[bytes, list[bytes]]:
    """Write symbols, last one first.

    Parameters
    ----------
    batches : list of lists of (frequency, start), each (n,) int64
        Of each symbol, run by run, in the order of reading; each run begins in lane 0.
    lanes : int

    Returns
    -------
    states : bytes
        The lanes' states, 4 bytes each.
    words : list of bytes
        Of each batch: words of 2 bytes in the order of reading.
    """
    state = np.full(lanes, _LEAST, np.int64)
    parts = [_encode_batch(runs, state) for runs in reversed(batches)]
    return state.astype("<u4").tobytes(), parts[::-1]


def _encode_batch(runs: list[tuple[Ints, Ints]], state: Ints) -> bytes:
    words: list[np.ndarray] = []
    lanes = len(state)
    for frequency, start in reversed(runs):
        limit = frequency << (32 - SCALE_BITS)
        for first in range((len(frequency) - 1) // lanes * lanes, -1, -lanes):
            own = frequency[first : first + lanes]
            active = state[: len(own)]
            full = (active >= limit[first : first + lanes]).nonzero()[0]
            if len(full):
                held = active.take(full)
                words.append(held & 0xFFFF)
                active[full] = held >> 16
            quotient = active // own
            # the state becomes quotient * 2^12 + rest + start
            active += quotient * (SCALE - own)
            active += start[first : first + lanes]
    body = np.concatenate(words[::-1]) if words else np.zeros(0, np.int64)
    return body.astype("<u2").tobytes()


class RansReader:
    """Reads what `encode` wrote, batch by batch.

    Parameters
    ----------
    states : bytes
    """

    def __init__(self, states: bytes) -> None:
        self._state = np.frombuffer(states, "<u4").astype(np.int64)
        self._words = np.zeros(0, np.int64)
        self._position = 0

    def feed(self, words: bytes) -> None:
        """Go on with the next batch."""
        self._words = np.frombuffer(words, "<u2").astype(np.int64)
        self._position = 0

    def read(self, context: Ints, frequency: Ints, start: Ints) -> Ints:
        """Return the next symbols, one for each context: (n,) int64.

        Parameters
        ----------
        context : ndarray, (n,) int64
        frequency, start : ndarray, (contexts, symbols) int64
        """
        symbols = np.zeros(len(context), np.int64)
        lanes, width = len(self._state), frequency.shape[1]
        # rows of small numbers are gathered and compared many at a time: no table of all slots is worth its making
        ends = (start + frequency).astype(np.int16)
        starts, widths = start.ravel(), frequency.ravel()
        first = context * width
        for begin in range(0, len(context), lanes):
            own = context[begin : begin + lanes]
            state = self._state[: len(own)]
            slot = state & (SCALE - 1)
            if width == 2:
                symbol = (slot >= ends[:, 0].take(own)).view(np.int8)
            else:
                symbol = (ends.take(own, axis=0) > slot.astype(np.int16)[:, None]).argmax(axis=1)
            symbols[begin : begin + lanes] = symbol
            place = first[begin : begin + lanes] + symbol
            state >>= SCALE_BITS
            state *= widths.take(place)
            state += slot
            state -= starts.take(place)
            self._refill(state)
        return symbols

    def _refill(self, state: Ints) -> None:
        """Take a word for each lane that has run low."""
        low = (state < _LEAST).nonzero()[0]
        if len(low):
            more = self._words[self._position : self._position + len(low)]
            if len(more) < len(low):
                raise StreamError("the stream is damaged: a batch ends too early; fetch the file again")
            state[low] = (state.take(low) << 16) | more
            self._position += len(low)
