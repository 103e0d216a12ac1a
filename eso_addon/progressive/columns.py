# SPDX-License-Identifier: GPL-3.0-or-later
"""Columns of numbers as deflated planes of bytes: for the base, for attributes, for the original's order."""

from __future__ import annotations

import zlib

import numpy as np

from ..core.mesh import Ints
from .errors import StreamError


class ColumnWriter:
    """Collects columns of one block."""

    def __init__(self) -> None:
        self._planes: list[bytes] = []

    def column(self, width: int, expected: Ints, known: Ints | None, count: int) -> Ints:
        """Write integers of `width` bytes as differences from what is expected, modulo 2 to the 8 * width."""
        assert known is not None
        bits = 8 * width
        mask = (1 << bits) - 1
        rest = (known - expected) & mask
        rest = ((rest << 1) ^ -(rest >> (bits - 1))) & mask  # small differences of either sign become small numbers
        planes = rest.astype("<u8").view(np.uint8).reshape(-1, 8)[:, :width]
        self._planes.append(planes.T.tobytes())
        return known

    def finish(self) -> bytes:
        """Return the block."""
        raw = b"".join(self._planes)
        packer = zlib.compressobj(9, zlib.DEFLATED, -15, 9)
        return packer.compress(raw) + packer.flush() if raw else b""


class ColumnReader:
    """Gives the columns of one block back."""

    def __init__(self, data: bytes) -> None:
        self._unpacker = zlib.decompressobj(-15)
        self._data = data
        self._raw = b""

    def column(self, width: int, expected: Ints, known: Ints | None, count: int) -> Ints:
        """Read `count` integers of `width` bytes."""
        size = width * count
        raw = self._take(size)
        planes = np.zeros((count, 8), np.uint8)
        planes[:, :width] = np.frombuffer(raw, np.uint8).reshape(width, count).T
        rest = planes.view("<i8").ravel().astype(np.int64)
        mask = (1 << 8 * width) - 1
        return (((rest >> 1) ^ -(rest & 1)) + expected) & mask

    def _take(self, size: int) -> bytes:
        """Return the next bytes of the block, never unpacking more than asked for."""
        missing = size - len(self._raw)
        if missing > 0:
            try:
                more = self._unpacker.decompress(self._data, missing)
            except zlib.error:
                more = b""
            self._data = self._unpacker.unconsumed_tail
            if len(more) < missing:
                raise StreamError("the stream is damaged: a block ends too early; fetch the file again")
            self._raw += more
        raw, self._raw = self._raw[:size], self._raw[size:]
        return raw


def as_words(array: np.ndarray) -> tuple[Ints, int]:
    """Return an array's rows as integers, (rows, columns), and their width in bytes; floats in their order."""
    width = min(array.dtype.itemsize, 4)
    columns = int(np.prod(array.shape[1:], dtype=int)) * array.dtype.itemsize // width
    words = np.ascontiguousarray(array).ravel().view(f"<u{width}").reshape(len(array), columns).astype(np.int64)
    if array.dtype == np.float32:
        words = np.where(words >> 31, 0xFFFFFFFF - words, words | 0x80000000)
    return words, width


def from_words(words: Ints, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array whose rows were these integers."""
    if dtype == np.float32:
        words = np.where(words >> 31, words & 0x7FFFFFFF, 0xFFFFFFFF - words)
    width = min(dtype.itemsize, 4)
    return np.ascontiguousarray(words.astype(f"<u{width}")).view(np.uint8).view(dtype).reshape(len(words), *shape)
