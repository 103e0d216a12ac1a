# SPDX-License-Identifier: GPL-3.0-or-later
"""One interface for writing and reading, so that both run the same code: values go in or come out."""

from __future__ import annotations

import numpy as np

from ..core.mesh import Ints
from .bits import BitReader, pack
from .models import Model
from .rans import RansReader

# a number's class: its length in bits and the bit below its highest one
CLASSES = 72


class Writer:
    """Collects symbols and plain bits of a batch."""

    def __init__(self) -> None:
        self._runs: list[tuple[Ints, Ints]] = []
        self._values: list[Ints] = []
        self._widths: list[Ints] = []

    def symbols(self, model: Model, context: Ints, known: Ints | None) -> Ints:
        """Write symbols, each in its context, and learn from them."""
        assert known is not None
        frequency, start = model.frequencies()
        place = context * frequency.shape[1] + known
        self._runs.append((frequency.take(place), start.take(place)))
        model.learn(context, known)
        return known

    def bits(self, widths: Ints, known: Ints | None) -> Ints:
        """Write numbers of these widths as they are."""
        assert known is not None
        self._values.append(known)
        self._widths.append(widths)
        return known

    @property
    def runs(self) -> list[tuple[Ints, Ints]]:
        """Frequency and start of each symbol, run by run."""
        return self._runs

    def plain(self) -> bytes:
        """Return the plain bits."""
        none = [np.zeros(0, np.int64)]
        return pack(np.concatenate(none + self._values), np.concatenate(none + self._widths))


class Reader:
    """Gives symbols and plain bits of a batch back."""

    def __init__(self, symbols: RansReader, plain: bytes) -> None:
        self._symbols = symbols
        self._plain = BitReader(plain)

    def symbols(self, model: Model, context: Ints, known: Ints | None) -> Ints:
        """Read symbols, each in its context, and learn from them."""
        frequency, start = model.frequencies()
        found = self._symbols.read(context, frequency, start)
        model.learn(context, found)
        return found

    def bits(self, widths: Ints, known: Ints | None) -> Ints:
        """Read numbers of these widths."""
        return self._plain.read(widths)


def size_class(magnitudes: Ints) -> tuple[Ints, Ints]:
    """Return the class of each number from 0 below 2 to the 35th, and its number of bits below those of the class."""
    length = np.frexp(magnitudes.astype(np.float64))[1].astype(np.int64)  # exact below 2 to the 53rd
    rest = np.maximum(length - 2, 0)
    return np.where(magnitudes < 2, magnitudes, 2 * length - 4 + (magnitudes >> rest)), rest


def code_numbers(coder: Writer | Reader, model: Model, context: Ints, known: Ints | None) -> Ints:
    """Write or read whole numbers: class as a symbol, lower bits and sign as they are."""
    if known is None:
        classes = coder.symbols(model, context, None)
        rest, value = None, None
    else:
        magnitude = np.abs(known)
        classes, rest = size_class(magnitude)
        coder.symbols(model, context, classes)
        value = ((magnitude & ((1 << rest) - 1)) << 1) | (known < 0)
    length = np.maximum(classes >> 1, 1) - 1  # bits below the class
    signed = (classes > 0).astype(np.int64)
    value = coder.bits(length + signed, value)
    if known is not None:
        return known
    top = np.where(classes < 2, classes, (2 + (classes & 1)) << length)
    magnitude = top + (value >> 1)
    return np.where(value & 1, -magnitude, magnitude)
