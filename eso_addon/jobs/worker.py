# SPDX-License-Identifier: GPL-3.0-or-later
"""A generator of the engine, run to its end: at once, or in a thread that can be stopped between two steps."""

import threading
from collections.abc import Generator
from typing import Generic, TypeVar
from weakref import WeakSet

Result = TypeVar("Result")
Steps = Generator[float, None, Result]

# A step that lasts longer is left to end by itself: it touches arrays only, and nobody takes its result.
GRACE_SECONDS = 3.0

_running: "WeakSet[Worker]" = WeakSet()


class Worker(Generic[Result]):
    """Runs steps in a thread; they may touch arrays only, never Blender's data."""

    def __init__(self, steps: Steps[Result]) -> None:
        self.progress = 0.0
        self._steps = steps
        self._stop = threading.Event()
        self._result: Result | None = None
        self._error: BaseException | None = None
        # A daemon, so that Blender can quit although nobody joined it.
        self._thread = threading.Thread(target=self._run, name="ESO LOD", daemon=True)
        _running.add(self)
        self._thread.start()

    @property
    def is_stopped(self) -> bool:
        """Whether it was told to stop."""
        return self._stop.is_set()

    @property
    def is_running(self) -> bool:
        """Whether the thread still works."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Tell the thread to stop after the step it is in; does not wait for it."""
        self._stop.set()

    def join(self, timeout: float | None = None) -> None:
        """Wait for the thread, at most so many seconds."""
        self._thread.join(timeout)
        if not self._thread.is_alive():
            _running.discard(self)

    def result(self) -> Result | None:
        """Wait for the thread and give the result, None if it was stopped; raises what the steps raised."""
        self.join()
        if self._error is not None:
            raise self._error
        return self._result

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self.progress = float(next(self._steps))
            self._steps.close()
        except StopIteration as end:
            self._result = end.value
        except BaseException as error:  # handed to the thread that asks for the result
            self._error = error


def stop_all() -> None:
    """Stop every worker and wait for its thread: before a file is loaded and when the add-on goes."""
    workers = list(_running)
    for worker in workers:
        worker.stop()
    for worker in workers:
        worker.join(GRACE_SECONDS)
