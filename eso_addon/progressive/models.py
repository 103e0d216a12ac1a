# SPDX-License-Identifier: GPL-3.0-or-later
"""Frequencies of symbols by context, learnt from the batches that came before, alike in writer and reader."""

import numpy as np

from ..core.mesh import Ints

SCALE_BITS = 12
SCALE = 1 << SCALE_BITS
_GAIN = 32


class Model:
    """Counts of symbols in each context; `frequencies` adds up to 2 to the 12th in each.

    Parameters
    ----------
    contexts, symbols : int
    shared : bool
        Contexts are classes of an expected size on the symbols' own scale: what one context learns of the difference
        between symbol and context helps the others.
    """

    def __init__(self, contexts: int, symbols: int, *, shared: bool = False) -> None:
        self.counts = np.zeros((contexts, symbols), np.int64)
        self.shared = np.zeros(contexts + symbols, np.int64) if shared else None
        self._difference = np.arange(symbols) - np.arange(contexts)[:, None] + contexts

    def frequencies(self) -> tuple[Ints, Ints]:
        """Return frequencies, each at least 1, and where each symbol starts: (contexts, symbols) int64."""
        contexts, symbols = self.counts.shape
        counts = self.counts * _GAIN + 1
        if self.shared is not None:
            counts += (self.shared * 4 * _GAIN // contexts).take(self._difference)
        total = counts.sum(axis=1, keepdims=True)
        # in double precision, which is exact here: a quotient below 2 to the 12th of numbers far below 2 to the 53rd
        frequency = 1 + (counts * (SCALE - symbols) / total).astype(np.int64)
        most = counts.argmax(axis=1)
        rows = np.arange(contexts)
        frequency[rows, most] += SCALE - frequency.sum(axis=1)
        return frequency, np.cumsum(frequency, axis=1) - frequency

    def learn(self, context: Ints, symbol: Ints) -> None:
        """Count what a batch held."""
        contexts, symbols = self.counts.shape
        new = np.bincount(context * symbols + symbol, minlength=contexts * symbols).reshape(contexts, symbols)
        self.counts = (self.counts >> 1) + new  # the last batches are most like the next one
        if self.shared is not None:
            self.shared += np.bincount(symbol - context + contexts, minlength=contexts + symbols)
