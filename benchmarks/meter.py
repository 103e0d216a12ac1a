# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds and peak memory of a stretch of code in this process."""

from __future__ import annotations

import ctypes
import gc
import time
from pathlib import Path
from typing import Self

STATUS, CLEAR_REFS = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def _status(field: str) -> int:
    """Return a memory field of this process's status in bytes; 0 where there is no such thing."""
    if not STATUS.exists():
        return 0
    return next(int(line.split()[1]) * 1024 for line in STATUS.read_text().splitlines() if line.startswith(field))


class Meter:
    """Measure a `with` block: `.seconds`, and `.peak` bytes beyond what the process held when the block began."""

    seconds: float = 0.0
    peak: int = 0

    def __enter__(self) -> Self:
        gc.collect()
        if CLEAR_REFS.exists():
            # What earlier calls freed must go back to the system, or this one could use it unseen.
            ctypes.CDLL(None).malloc_trim(0)
            CLEAR_REFS.write_text("5")
        self._held = _status("VmRSS")
        self._start = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self.seconds = time.perf_counter() - self._start
        self.peak = max(0, _status("VmHWM") - self._held)
