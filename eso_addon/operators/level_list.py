# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons beside the list of levels: add, remove, and the levels that suit an engine."""

import bpy

from ..settings.level_sets import LEVEL_SETS


class SCENE_OT_eso_level_set(bpy.types.Operator):
    """Take the levels and the profile that suit an engine"""

    bl_idname = "scene.eso_level_set"
    bl_label = "Levels for an Engine"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    name: bpy.props.StringProperty(name="Name", description="Which set of levels")  # type: ignore[valid-type]

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set profile and ratios."""
        if self.name not in LEVEL_SETS:
            self.report({"ERROR"}, f"There is no set of levels '{self.name}': choose one of {', '.join(LEVEL_SETS)}")
            return {"CANCELLED"}
        settings = context.scene.eso_lod
        settings.profile, settings.ratios = LEVEL_SETS[self.name]
        settings.levels_by = "ratio"
        return {"FINISHED"}


class SCENE_OT_eso_level_add(bpy.types.Operator):
    """Add a coarser level"""

    bl_idname = "scene.eso_level_add"
    bl_label = "Add Level"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add it."""
        context.scene.eso_lod.add_level()
        return {"FINISHED"}


class SCENE_OT_eso_level_remove(bpy.types.Operator):
    """Remove the coarsest level"""

    bl_idname = "scene.eso_level_remove"
    bl_label = "Remove Level"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove it."""
        context.scene.eso_lod.remove_level()
        return {"FINISHED"}


OPERATORS = (SCENE_OT_eso_level_set, SCENE_OT_eso_level_add, SCENE_OT_eso_level_remove)
