# SPDX-License-Identifier: GPL-3.0-or-later
"""Has the engine's results probe their errors in a thread, not in the window's: before the end, or after a replay."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

import bpy

from ..jobs.worker import Worker

if TYPE_CHECKING:
    from ..core.levels import SimplifyResult

_POLL_SECONDS = 0.1
_asked: list[Worker[None]] = []


def with_errors_if_run(
    steps: Generator[float, None, tuple[list[SimplifyResult], bool]],
) -> Generator[float, None, list[SimplifyResult]]:
    """Run the steps of a replay; in a window only a run of the engine leaves time for the errors too."""
    results, replayed = yield from steps
    if not replayed or bpy.app.background:
        yield from _probe(results)
    return results


def known_error(result: SimplifyResult) -> float | None:
    """Give the error if it has been probed."""
    return result.__dict__.get("error")


def probe_later(result: SimplifyResult, then: Callable[[float], None]) -> None:
    """Probe in a thread what a replay had no time for, and hand it over in the window's; the last to ask is served."""
    while _asked:
        _asked.pop().stop()
    worker = Worker(_steps(result))
    _asked.append(worker)

    def poll() -> float | None:
        if worker.is_stopped:
            return None
        if worker.is_running:
            return _POLL_SECONDS
        error = known_error(result)
        if error is not None:
            then(error)
        return None

    bpy.app.timers.register(poll, first_interval=_POLL_SECONDS)


def _steps(result: SimplifyResult) -> Generator[float, None, None]:
    yield from _probe([result])


def _probe(results: list[SimplifyResult]) -> Generator[float, None, None]:
    for result in results:
        yield 1.0
        _ = result.error
