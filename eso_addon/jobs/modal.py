# SPDX-License-Identifier: GPL-3.0-or-later
"""What every operator that runs the engine shares: run to the end in scripts, run beside the window otherwise."""

import time
from typing import Any

import bpy

from ..core.mesh import MeshError
from .worker import GRACE_SECONDS, Steps, Worker, run_to_end

_POLL_SECONDS = 0.05
# What the user may go on doing while the engine works; anything else could change the source under it.
_VIEW_EVENTS = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM"}


class EngineOperator:
    """An operator in three parts: read arrays in `prepare`, let the engine run, write once in `finish`."""

    seconds: float
    _worker: Worker[Any]
    _timer: Any
    _start: float
    _stop_time: float
    _shown: str = ""

    def prepare(self, context: bpy.types.Context) -> Steps[Any]:
        """Read Blender's data and return the engine's generator, which touches arrays only."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result: Any) -> None:  # noqa: ANN401 - the engine's, of any kind
        """Write the result and report."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run to the end: scripts, the redo panel, no window."""
        self._start = time.perf_counter()
        try:
            return self._finished(context, run_to_end(self.prepare(context)))
        except (MeshError, MemoryError) as error:
            return self._refused(error)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> set[str]:
        """Start the engine in a thread, if there is a window to keep alive."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self._start = time.perf_counter()
        try:
            self._worker = Worker(self.prepare(context))
        except (MeshError, MemoryError) as error:
            return self._refused(error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(_POLL_SECONDS, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._shown = ""
        self._show_progress(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show progress, stop on Esc, write the result when the thread has ended."""
        if event.type == "ESC" and event.value == "PRESS":
            self._worker.stop()
            self._stop_time = time.perf_counter()
        if self._worker.is_running and not self._is_given_up():
            if event.type == "TIMER":
                self._show_progress(context)
            return {"PASS_THROUGH"} if event.type in _VIEW_EVENTS else {"RUNNING_MODAL"}
        self._clean_up(context)
        if self._worker.is_stopped:
            self.report({"INFO"}, "Cancelled: nothing was changed")  # type: ignore[attr-defined]
            return {"CANCELLED"}
        try:
            return self._finished(context, self._worker.result())
        except (MeshError, MemoryError) as error:
            return self._refused(error)
        except ReferenceError:
            return self._refused(MeshError("the object was removed meanwhile: nothing was changed"))

    def cancel(self, context: bpy.types.Context) -> None:
        """Join the thread when Blender takes the operator away: a file is loaded, the window closed."""
        self._worker.stop()
        self._worker.join(GRACE_SECONDS)
        self._clean_up(context)

    def _is_given_up(self) -> bool:
        return self._worker.is_stopped and time.perf_counter() - self._stop_time > GRACE_SECONDS

    def _finished(self, context: bpy.types.Context, result: Any) -> set[str]:  # noqa: ANN401
        self.seconds = time.perf_counter() - self._start
        self.finish(context, result)
        return {"FINISHED"}

    def _refused(self, error: MeshError | MemoryError) -> set[str]:
        text = str(error) if isinstance(error, MeshError) else "not enough memory for this mesh: simplify it in parts"
        self.report({"ERROR"}, text[:1].upper() + text[1:])  # type: ignore[attr-defined]
        return {"CANCELLED"}

    def _show_progress(self, context: bpy.types.Context) -> None:
        percent = min(max(round(self._worker.progress * 100), 0), 100)
        state = "stopping" if self._worker.is_stopped else f"{percent} %" if percent else "working"
        text = f"{self.bl_label}: {state}   |   Esc: cancel"  # type: ignore[attr-defined]
        if text != self._shown:  # each change costs a redraw, which the engine waits for
            self._shown = text
            context.window_manager.progress_update(percent)
            context.workspace.status_text_set(text)

    def _clean_up(self, context: bpy.types.Context) -> None:
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
