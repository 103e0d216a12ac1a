# SPDX-License-Identifier: GPL-3.0-or-later
"""Hangs the drawing into every 3D viewport; what draws is loaded when there is something to draw."""

from typing import Any

import bpy

from ..operators import shown

_handles: list[Any] = []


def register() -> None:
    """Draw in every 3D viewport, where there are any."""
    if bpy.app.background:
        return
    space = bpy.types.SpaceView3D
    _handles.append(space.draw_handler_add(_draw_scene, (), "WINDOW", "POST_VIEW"))
    _handles.append(space.draw_handler_add(_draw_legend, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    """Draw no more."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def _draw_scene() -> None:
    if shown.shown() is not None:
        from .drawing import draw_scene

        draw_scene()


def _draw_legend() -> None:
    if shown.shown() is not None:
        from .drawing import draw_legend

        draw_legend()
