# SPDX-License-Identifier: GPL-3.0-or-later
"""Long arrays in blocks that stay in the processor's cache, on several threads where they pay."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")


class Blocks:
    """Runs a function over consecutive slices, with results in order whatever the number of threads.

    Parameters
    ----------
    threads : int, optional
        One where it is not given: the calls are short, and two threads that hand Python's lock to each other were
        slower (docs/decisions/engine.md).
    """

    def __init__(self, threads: int | None = None) -> None:
        self.threads = threads or 1
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def map(self, function: Callable[[slice], Result], count: int, size: int) -> list[Result]:
        """Call `function` with slices of `size` that cover `range(count)`."""
        parts = [slice(start, min(start + size, count)) for start in range(0, count, size)]
        if self._pool is None or len(parts) < 2:
            return [function(part) for part in parts]
        return list(self._pool.map(function, parts))

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
