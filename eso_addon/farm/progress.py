# SPDX-License-Identifier: GPL-3.0-or-later
"""A bar that says how far a batch is, how fast it goes, and how long it will take."""

from __future__ import annotations

import sys
import time
from typing import TextIO

_WIDTH = 28
_EACH = 200_000  # what a file costs besides its bytes, in bytes


class Bar:
    """A bar on a terminal; a line now and then where the output goes to a file.

    Parameters
    ----------
    files, size : int
        What is to be done: files, and bytes in all, by which the time left is reckoned.
    """

    def __init__(self, files: int, size: int, out: TextIO | None = None) -> None:
        self.files, self.size = files, max(size + files * _EACH, 1)
        self.done, self.failed, self.read = 0, 0, 0
        self.started = time.monotonic()
        self._out = out or sys.stdout
        self._told = 0.0

    def step(self, size: int, *, failed: bool = False) -> None:
        """Count one file."""
        self.done += 1
        self.failed += failed
        self.read += size + _EACH
        terminal = self._out.isatty()
        now = time.monotonic()
        if terminal or self.done == self.files or now - self._told > 10:
            self._told = now
            self._out.write(f"\r{self.line()}\x1b[K" if terminal else f"{self.line()}\n")
            self._out.flush()

    def close(self) -> None:
        """Leave the bar."""
        if self.done and self._out.isatty():
            self._out.write("\n")

    def line(self) -> str:
        """Give the bar as it is now."""
        seconds = max(time.monotonic() - self.started, 1e-6)
        part = 1.0 if self.done >= self.files else min(self.read / self.size, 1.0)
        full = int(part * _WIDTH)
        left = seconds * (1 - part) / part if part > 0 else None
        told = "?" if left is None else _clock(left)
        failed = f", {self.failed} set aside" if self.failed else ""
        return (f"[{'#' * full}{'.' * (_WIDTH - full)}] {self.done}/{self.files} files{failed}, "
                f"{self.done / seconds:.2f} files/s, {told} left")


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
