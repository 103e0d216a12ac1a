# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets of the panel, kept by Blender's preset system, and the sets of levels for engines."""

from typing import Any

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..settings.level_sets import LEVEL_SETS
from ..settings.lod_options import LodOptions
from ..settings.options import SimplifyOptions, option_names
from ..settings.preset_path import unknown_folders

SUBDIRECTORY = "eso_lod"
# Settings about one object, or about one place in one file.
_NOT_KEPT = {"vertex_group", "scope", "source_collection", "collection"}
_VALUES = [name for name in option_names(SimplifyOptions, LodOptions) if name not in _NOT_KEPT]


class _PresetMenu:
    """Lists the presets that come with the add-on, whether Blender knows where they are or not."""

    def path_menu(self, searchpaths: list[str], *arguments: Any, **options: Any) -> None:  # noqa: ANN401 - Blender's
        """List the presets in these folders and in ours."""
        folders = [*searchpaths, *unknown_folders(SUBDIRECTORY)]
        bpy.types.Menu.path_menu(self, folders, *arguments, **options)


class VIEW3D_MT_eso_presets(_PresetMenu, bpy.types.Menu):
    """Choose a preset."""

    bl_idname = "VIEW3D_MT_eso_presets"
    bl_label = "ESO LOD Presets"
    preset_subdir = SUBDIRECTORY
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class SCENE_OT_eso_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the settings of the panel as a preset, or remove one"""

    bl_idname = "scene.eso_preset_add"
    bl_label = "Add ESO LOD Preset"
    preset_menu = "VIEW3D_MT_eso_presets"
    preset_subdir = SUBDIRECTORY
    preset_defines = ["settings = bpy.context.scene.eso_lod"]
    preset_values = [f"settings.{name}" for name in _VALUES]


class VIEW3D_PT_eso_presets(_PresetMenu, PresetPanel, bpy.types.Panel):
    """The presets behind the icon in the panel's header."""

    bl_label = "ESO LOD Presets"
    preset_subdir = SUBDIRECTORY
    preset_operator = "script.execute_preset"
    preset_add_operator = "scene.eso_preset_add"


class VIEW3D_MT_eso_level_sets(bpy.types.Menu):
    """Choose levels for an engine."""

    bl_idname = "VIEW3D_MT_eso_level_sets"
    bl_label = "Levels for an Engine"

    def draw(self, _context: bpy.types.Context) -> None:
        """List the engines."""
        for name in LEVEL_SETS:
            self.layout.operator("scene.eso_level_set", text=name, translate=False).name = name


CLASSES = (
    VIEW3D_MT_eso_presets,
    SCENE_OT_eso_preset_add,
    VIEW3D_PT_eso_presets,
    VIEW3D_MT_eso_level_sets,
)


def register() -> None:
    """Register menus, panel and operator."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister them."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
