# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers of any width up to 40 bits, one after the other, in 32-bit words."""

import numpy as np

from ..core.mesh import Ints
from .errors import StreamError

_LOW = 0xFFFFFFFF


def pack(values: Ints, widths: Ints) -> bytes:
    """Write numbers one after the other, lowest bit first.

    Parameters
    ----------
    values : ndarray, (n,) int64
        Each at least 0 and below 2 to its width.
    widths : ndarray, (n,) int64
        At most 40 bits.

    Returns
    -------
    bytes
        Little-endian words of 32 bits.
    """
    ends = np.cumsum(widths)
    total = int(ends[-1]) if len(ends) else 0
    words = (total + 31) // 32
    start = ends - widths
    place, shift = start >> 5, start & 31
    low = (values & 0xFFFFF) << shift
    high = (values >> 20) << ((start + 20) & 31)
    high_place = (start + 20) >> 5
    # no two numbers share a bit, so sums are unions; below 2 to the 53rd they are exact
    parts = np.concatenate((place, place + 1, high_place, high_place + 1))
    weights = np.concatenate((low & _LOW, low >> 32, high & _LOW, high >> 32)).astype(np.float64)
    return np.bincount(parts, weights, words + 3)[:words].astype("<u4").tobytes()


class BitReader:
    """Reads what `pack` wrote.

    Parameters
    ----------
    data : bytes
        Whole words of 32 bits.
    """

    def __init__(self, data: bytes) -> None:
        self._words = np.append(np.frombuffer(data, "<u4").astype(np.int64), [0, 0])
        self._limit = len(data) * 8
        self.position = 0

    def read(self, widths: Ints) -> Ints:
        """Return the next numbers of these widths: (n,) int64."""
        ends = np.cumsum(widths) + self.position
        if len(ends) == 0:
            return np.zeros(0, np.int64)
        if int(ends[-1]) > self._limit:
            raise StreamError("the stream is damaged: a batch has too few bits; fetch the file again")
        start = ends - widths
        self.position = int(ends[-1])
        place, shift = start >> 5, start & 31
        low = self._words.take(place) >> shift
        low |= self._words.take(place + 1) << (32 - shift)
        # 64 bits hold 32 + 32 - shift of them: the rest of wide numbers comes from the third word
        low &= _LOW
        wide = np.flatnonzero(widths > 32)
        if len(wide):
            place, shift = place.take(wide) + 1, shift.take(wide)
            high = (self._words.take(place) >> shift) | (self._words.take(place + 1, mode="clip") << (32 - shift))
            low[wide] |= (high & 0xFF) << 32
        return low & ((1 << widths) - 1)
