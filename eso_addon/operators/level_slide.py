# SPDX-License-Identifier: GPL-3.0-or-later
"""The level slider: every level of the active mesh under the mouse, drawn while dragged, written when it rests."""

import time
from typing import Any

import bpy

from ..jobs.modal import VIEW_EVENTS
from ..settings.scene import on_level
from . import shown
from .polls import poll_with, why_not_simplify
from .simplify import SimplifyReading

_POLL_SECONDS = 0.1
_REST_SECONDS = 0.25

_sessions: list["OBJECT_OT_eso_level_slide"] = []


def session() -> "OBJECT_OT_eso_level_slide | None":
    """Give the slider that is out, None if there is none."""
    return _sessions[-1] if _sessions else None


def show_level(context: bpy.types.Context) -> None:
    """Draw the level that the slider stands at; called by its property's update callback."""
    if _sessions:
        _sessions[-1].draw_level(context.window_manager.eso_last_run.level)


class OBJECT_OT_eso_level_slide(SimplifyReading, bpy.types.Operator):
    """Drag through all levels of the active mesh; where the slider rests, the level becomes an object"""

    bl_idname = "object.eso_level_slide"
    bl_label = "ESO Level Slider"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    # The levels once they are there, what was made of one, and how it is to end.
    faces: int
    ending: str
    milliseconds: list[float]
    _view: Any
    _name: str
    _result_name: str
    _dragged: bool
    _moved: float

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need an active mesh object and no other slider."""
        return poll_with(cls, "Let the other slider go first" if _sessions else why_not_simplify(context))

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Refuse: without a window there is nothing to drag."""
        self.report({"ERROR"}, "The level slider needs a window: use Simplify in scripts")
        return {"CANCELLED"}

    def prepare(self, context: bpy.types.Context) -> Any:  # noqa: ANN401 - as of Simplify
        """Read the active mesh; the engine runs beside the window unless its last run was this one."""
        self.target, self.ratio, self.refit, self.in_place, self.only_selected = "ratio", 1.0, False, False, False
        self._result_name, self._view, self.ending, self.milliseconds = "", None, "", []
        return super().prepare(context)

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Wait for the engine, then for the slider."""
        if self._view is None:
            return super().modal(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            self.ending = "drop"
        elif event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            self.ending = "keep"
        if self.ending:
            return self._end(context)
        # The slider keeps the mouse's release to itself, so that a rest stands for it.
        if event.type == "TIMER" and self._dragged and time.perf_counter() - self._moved > _REST_SECONDS:
            self._write(context)
        return {"PASS_THROUGH"} if event.type in VIEW_EVENTS or _over_sidebar(context, event) else {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Leave everything as it was when Blender takes the operator away."""
        if self._view is None:
            super().cancel(context)
        elif self in _sessions:
            self.ending = "drop"
            self._end(context)

    def draw_level(self, share: float) -> None:
        """Draw the level at a place of the slider, 0 the coarsest and 1 the mesh itself."""
        begun = time.perf_counter()
        self.faces, points, corners = self._view.at(share)
        self._result_hidden(True)
        shown.show(shown.Overlay("level", self._object.name, points, corners))
        self._dragged, self._moved = True, time.perf_counter()
        self.milliseconds.append(1000 * (time.perf_counter() - begun))

    def _finished(self, context: bpy.types.Context, result: Any) -> set[str]:  # noqa: ANN401
        """Put the slider out."""
        from ..jobs.replay import kept
        from .level_view import LevelView

        recording = kept()
        if recording is None or self._object.name not in context.view_layer.objects:
            self.report({"ERROR"}, "The mesh was changed meanwhile: try again")
            return {"CANCELLED"}
        self._view = LevelView(recording, self._source)
        self._name = self._object.name
        self._dragged = False
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        _sessions.append(self)
        self._object.hide_set(True)
        context.window_manager.eso_last_run.level = 1.0  # draws it
        self._dragged = False
        return {"RUNNING_MODAL"}

    def _write(self, context: bpy.types.Context) -> None:
        """Make an object of the level that is shown, in place of the one before: Simplify replays it."""
        self._dragged = False
        self._remove_result()
        self._object.hide_set(False)
        context.view_layer.objects.active = self._object
        taken = bpy.ops.object.eso_simplify.get_rna_type().properties
        options = {name: getattr(self, name) for name, kind in taken.items() if not kind.is_readonly}
        options.update(target="count", faces_target=max(self.faces, 1))
        bpy.ops.object.eso_simplify("EXEC_DEFAULT", False, **options)
        self._result_name = context.view_layer.objects.active.name
        self._object.hide_set(True)
        shown.hide()

    def _end(self, context: bpy.types.Context) -> set[str]:
        if self.ending == "keep" and self._dragged:
            self._write(context)
        if self.ending == "drop":
            self._remove_result()
        if self in _sessions:
            _sessions.remove(self)
        context.window_manager.event_timer_remove(self._timer)
        shown.hide()
        source = bpy.data.objects.get(self._name)
        if source is not None:
            source.hide_set(bool(self._result_name) and self.hide_others)
            if not self._result_name:
                context.view_layer.objects.active = source
                source.select_set(True)
        return {"FINISHED"} if self._result_name else {"CANCELLED"}

    def _result_hidden(self, hidden: bool) -> None:
        result = bpy.data.objects.get(self._result_name)
        if result is not None and result.hide_get() != hidden:
            result.hide_set(hidden)

    def _remove_result(self) -> None:
        result = bpy.data.objects.get(self._result_name)
        if result is not None:
            bpy.data.meshes.remove(result.data)  # the object goes with it
        self._result_name = ""


def _over_sidebar(context: bpy.types.Context, event: bpy.types.Event) -> bool:
    """Tell whether the mouse is where the slider and its buttons are."""
    for area in context.window.screen.areas:
        for region in area.regions if area.type == "VIEW_3D" else ():
            right, above = event.mouse_x - region.x, event.mouse_y - region.y
            if region.type == "UI" and 0 <= right < region.width and 0 <= above < region.height:
                return True
    return False


class OBJECT_OT_eso_level_slide_end(bpy.types.Operator):
    """End the level slider"""

    bl_idname = "object.eso_level_slide_end"
    bl_label = "ESO End Level Slider"
    bl_options = {"INTERNAL"}

    keep: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Keep", description="Keep the level as an object; otherwise everything is as it was", default=True
    )

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Need a slider that is out."""
        return poll_with(cls, "" if _sessions else "The level slider is not out")

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Tell the slider, which ends at the next event."""
        _sessions[-1].ending = "keep" if self.keep else "drop"
        return {"FINISHED"}


def register() -> None:
    """Listen to the slider."""
    on_level.append(show_level)


def unregister() -> None:
    """Listen no more, and put the slider away."""
    on_level.clear()
    _sessions.clear()


OPERATORS = (OBJECT_OT_eso_level_slide, OBJECT_OT_eso_level_slide_end)
