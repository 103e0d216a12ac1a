# SPDX-License-Identifier: GPL-3.0-or-later
import threading
from collections.abc import Generator

import pytest

from eso_addon.core.mesh import MeshError
from eso_addon.core.steps import run_to_end
from eso_addon.jobs.worker import Worker, stop_all


def counting(count: int) -> Generator[float, None, str]:
    for step in range(count):
        yield step / count
    return "done"


def gated(gate: threading.Event, closed: threading.Event) -> Generator[float, None, str]:
    """Go on for ever, a step at a time."""
    try:
        yield 0.25
        while True:
            gate.wait()
            yield 0.5
    finally:
        closed.set()


def failing() -> Generator[float, None, str]:
    yield 0.0
    raise MeshError("give it faces")


def test_at_once_and_in_a_thread_give_the_same() -> None:
    assert run_to_end(counting(5)) == "done"
    worker = Worker(counting(5))
    assert worker.result() == "done"
    assert worker.progress == 0.8
    assert not worker.is_running


def test_no_steps_at_all() -> None:
    assert Worker(counting(0)).result() == "done"


def test_a_stopped_worker_closes_its_steps_and_has_no_result() -> None:
    gate, closed = threading.Event(), threading.Event()
    worker = Worker(gated(gate, closed))
    assert worker.is_running
    worker.stop()
    gate.set()
    assert worker.result() is None
    assert worker.is_stopped
    assert closed.is_set()


def test_what_the_steps_raise_is_raised_where_the_result_is_asked_for() -> None:
    with pytest.raises(MeshError, match="give it faces"):
        Worker(failing()).result()
    with pytest.raises(MeshError, match="give it faces"):
        run_to_end(failing())


def test_all_threads_end_together() -> None:
    gate = threading.Event()
    closed = [threading.Event() for _ in range(3)]
    workers = [Worker(gated(gate, event)) for event in closed]
    gate.set()
    stop_all()
    assert all(event.is_set() for event in closed)
    assert not any(worker.is_running for worker in workers)
    stop_all()
