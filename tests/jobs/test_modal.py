# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators cannot run without a window, so Blender's part is played by stand-ins."""

import threading
from collections.abc import Generator
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import pytest

from eso_addon.core.mesh import MeshError
from eso_addon.jobs import modal
from eso_addon.jobs.modal import EngineOperator

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")
KEY = SimpleNamespace(type="X", value="PRESS")
WHEEL = SimpleNamespace(type="WHEELUPMOUSE", value="PRESS")


class Operator(EngineOperator):
    """Waits for its gate, then gives 42 or raises."""

    bl_label = "Test"

    def __init__(self, error: Exception | None = None) -> None:
        self.gate = threading.Event()
        self.error = error
        self.reports: list[tuple[set[str], str]] = []
        self.written: list[int] = []

    def report(self, kind: set[str], text: str) -> None:
        self.reports.append((kind, text))

    def prepare(self, context: object) -> Generator[float, None, int]:
        return self._steps()

    def _steps(self) -> Generator[float, None, int]:
        yield 0.5
        self.gate.wait()
        yield 0.75
        if self.error:
            raise self.error
        return 42

    def finish(self, context: object, result: int) -> None:
        self.written.append(result)


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> MagicMock:
    monkeypatch.setattr(modal, "bpy", SimpleNamespace(app=SimpleNamespace(background=False), types=bpy.types))
    monkeypatch.setattr(modal, "_SHOW_SECONDS", 0.0)
    return MagicMock()


def started(operator: Operator, context: MagicMock) -> Operator:
    assert operator.invoke(context, None) == {"RUNNING_MODAL"}
    assert operator.modal(context, TIMER) == {"RUNNING_MODAL"}
    return operator


def ended(operator: Operator, context: MagicMock) -> set[str]:
    operator.gate.set()
    operator._worker.join()
    return operator.modal(context, TIMER)


def assert_cleaned_up(context: MagicMock) -> None:
    context.window_manager.event_timer_remove.assert_called_once()
    assert context.window_manager.eso_last_run.running == ""
    context.workspace.status_text_set.assert_called_with(None)


def test_the_result_is_written_once_at_the_end(context: MagicMock) -> None:
    operator = started(Operator(), context)
    assert operator.written == []
    draw = context.workspace.status_text_set.call_args.args[0]
    header = MagicMock()
    draw(header, context)
    assert header.layout.row().progress.call_args.kwargs == {"factor": 0.5, "text": "50%"}
    assert ended(operator, context) == {"FINISHED"}
    assert operator.written == [42]
    assert operator.seconds > 0
    assert_cleaned_up(context)


def test_esc_writes_nothing(context: MagicMock) -> None:
    operator = started(Operator(), context)
    assert operator.modal(context, ESC) == {"RUNNING_MODAL"}
    assert ended(operator, context) == {"CANCELLED"}
    assert operator.written == []
    assert not operator._worker.is_running
    assert_cleaned_up(context)


def test_a_step_that_lasts_is_left_to_itself_after_esc(context: MagicMock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modal, "GRACE_SECONDS", -1.0)
    operator = started(Operator(), context)
    assert operator.modal(context, ESC) == {"CANCELLED"}
    assert operator.written == []
    assert_cleaned_up(context)
    operator.gate.set()


def test_meanwhile_the_view_moves_and_nothing_else_happens(context: MagicMock) -> None:
    operator = started(Operator(), context)
    assert operator.modal(context, KEY) == {"RUNNING_MODAL"}
    assert operator.modal(context, WHEEL) == {"PASS_THROUGH"}
    ended(operator, context)


@pytest.mark.parametrize(
    ("error", "text"), [(MeshError("give it faces"), "Give it faces"), (MemoryError(), "Not enough memory")]
)
def test_an_error_is_one_line(context: MagicMock, error: Exception, text: str) -> None:
    operator = started(Operator(error), context)
    assert ended(operator, context) == {"CANCELLED"}
    assert operator.reports[0][0] == {"ERROR"}
    assert operator.reports[0][1].startswith(text)
    assert_cleaned_up(context)


def test_a_bug_is_not_hidden(context: MagicMock) -> None:
    operator = started(Operator(ZeroDivisionError()), context)
    with pytest.raises(ZeroDivisionError):
        ended(operator, context)
    assert_cleaned_up(context)


def test_blender_takes_the_operator_away(context: MagicMock) -> None:
    operator = started(Operator(), context)
    operator.gate.set()
    operator.cancel(context)
    assert not operator._worker.is_running
    assert operator.written == []
    assert_cleaned_up(context)


def test_without_a_window_it_runs_to_the_end() -> None:
    operator = Operator()
    operator.gate.set()
    assert operator.invoke(SimpleNamespace(window=None), None) == {"FINISHED"}
    assert operator.written == [42]
