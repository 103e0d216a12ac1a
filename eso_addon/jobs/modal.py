# SPDX-License-Identifier: GPL-3.0-or-later
"""What every operator that runs the engine shares: run to the end in scripts, run beside the window otherwise."""

import time
from typing import Any

import bpy

from ..core.errors import MeshError
from ..core.steps import run_to_end
from .refusal import refuse
from .worker import GRACE_SECONDS, Steps, Worker

_POLL_SECONDS = 0.01
# Each picture of the bar costs a redraw, which window and engine wait for.
_SHOW_SECONDS = 1.0
# What the user may go on doing while the engine works; anything else could change the source under it.
VIEW_EVENTS = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "MOUSEMOVE", "TRACKPADPAN", "TRACKPADZOOM"}


class EngineOperator:
    """An operator in three parts: read arrays in `prepare`, let the engine run, write once in `finish`."""

    _worker: Worker[Any]
    _timer: Any
    _start: float
    _stop_time: float
    _show_time: float = 0.0

    @property
    def seconds(self) -> float:
        """How long it has taken so far."""
        return time.perf_counter() - self._start

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
            return refuse(self, error)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> set[str]:
        """Start the engine in a thread, if there is a window to keep alive."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self._start = time.perf_counter()
        try:
            self._worker = Worker(self.prepare(context))
        except (MeshError, MemoryError) as error:
            return refuse(self, error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(_POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        self._show_progress(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show progress, stop on Esc, write the result when the thread has ended."""
        if event.type == "ESC" and event.value == "PRESS":
            self._worker.stop()
            self._stop_time = time.perf_counter()
        if self._worker.is_running and not self._is_given_up():
            if event.type == "TIMER" and time.perf_counter() - self._show_time >= _SHOW_SECONDS:
                self._show_progress(context)
            return {"PASS_THROUGH"} if event.type in VIEW_EVENTS else {"RUNNING_MODAL"}
        self._clean_up(context)
        if self._worker.is_stopped:
            self.report({"INFO"}, "Cancelled: nothing was changed")  # type: ignore[attr-defined]
            return {"CANCELLED"}
        try:
            return self._finished(context, self._worker.result())
        except (MeshError, MemoryError) as error:
            return refuse(self, error)
        except ReferenceError:
            return refuse(self, MeshError("the object was removed meanwhile: nothing was changed"))

    def cancel(self, context: bpy.types.Context) -> None:
        """Join the thread when Blender takes the operator away: a file is loaded, the window closed."""
        self._worker.stop()
        self._worker.join(GRACE_SECONDS)
        self._clean_up(context)

    def _is_given_up(self) -> bool:
        return self._worker.is_stopped and time.perf_counter() - self._stop_time > GRACE_SECONDS

    def _finished(self, context: bpy.types.Context, result: Any) -> set[str]:  # noqa: ANN401
        self.finish(context, result)
        return {"FINISHED"}

    def _show_progress(self, context: bpy.types.Context) -> None:
        self._show_time = time.perf_counter()
        run = context.window_manager.eso_last_run
        run.running = self.bl_label  # type: ignore[attr-defined]
        run.stopping = self._worker.is_stopped
        run.progress = min(max(self._worker.progress, 0.0), 1.0)
        context.workspace.status_text_set(_draw_status)
        _redraw_sidebars(context)

    def _clean_up(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.eso_last_run.running = ""
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        _redraw_sidebars(context)


def _draw_status(header: bpy.types.Header, context: bpy.types.Context) -> None:
    """Draw the bar in place of the status bar's usual hints."""
    run = context.window_manager.eso_last_run
    layout = header.layout
    layout.label(text=run.running, icon="MOD_DECIM")
    bar = layout.row()
    bar.ui_units_x = 10
    bar.progress(factor=run.progress, text=f"{run.progress:.0%}")
    layout.label(text="Stopping" if run.stopping else "Cancel", icon="EVENT_ESC")


def _redraw_sidebars(context: bpy.types.Context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                next(region for region in area.regions if region.type == "UI").tag_redraw()
