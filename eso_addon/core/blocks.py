# SPDX-License-Identifier: GPL-3.0-or-later
"""Long arrays in blocks that stay in the processor's cache, on several threads where they pay."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")

# faces from which on a second thread pays: below, its share of each call is too short to get Python's lock in time
_MANY = 200_000


class Blocks:
    """Runs a function over consecutive slices, with results in order whatever the number of threads.

    Parameters
    ----------
    threads : int, optional
        Where it is not given, two for a large mesh on a machine that has them, else one.
    faces : int
        Of the mesh.
    """

    def __init__(self, threads: int | None = None, faces: int = 0) -> None:
        self.threads = threads or min(2 if faces >= _MANY else 1, os.cpu_count() or 1)
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
