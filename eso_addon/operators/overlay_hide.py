# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that hides what the viewport shows over the scene."""

import bpy

from . import shown
from .polls import poll_with


class OBJECT_OT_eso_overlay_hide(bpy.types.Operator):
    """Hide the colours and lines that are drawn over the scene"""

    bl_idname = "object.eso_overlay_hide"
    bl_label = "ESO Hide Overlay"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Need something to hide."""
        return poll_with(cls, "" if shown.shown() else "Nothing is shown")

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Hide it."""
        shown.hide()
        return {"FINISHED"}


OPERATOR = OBJECT_OT_eso_overlay_hide
