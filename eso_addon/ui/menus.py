# SPDX-License-Identifier: GPL-3.0-or-later
"""The submenu `ESO LOD` in the Object menu and the object context menu; F3 finds only what is in a menu."""

import bpy

OPERATORS = (
    "object.eso_simplify",
    "object.eso_level_slide",
    "object.eso_lod_generate",
    "object.eso_lod_update",
    "object.eso_lod_hulls",
    "object.eso_lod_bake",
    "object.eso_lod_export",
    "object.eso_measure",
    "object.eso_weights_show",
    "object.eso_edges_show",
    "object.eso_deviation_show",
    "object.eso_overlay_hide",
)


class VIEW3D_MT_eso_lod(bpy.types.Menu):
    """Simplify, make levels of detail, measure."""

    bl_idname = "VIEW3D_MT_eso_lod"
    bl_label = "ESO LOD"

    def draw(self, _context: bpy.types.Context) -> None:
        """List the operators; they run beside the window."""
        self.layout.operator_context = "INVOKE_DEFAULT"
        for operator in OPERATORS:
            self.layout.operator(operator)


def draw_entry(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry in Blender's own menus."""
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_eso_lod.bl_idname)


def register() -> None:
    """Register the menu and append it to Blender's."""
    bpy.utils.register_class(VIEW3D_MT_eso_lod)
    bpy.types.VIEW3D_MT_object.append(draw_entry)
    bpy.types.VIEW3D_MT_object_context_menu.append(draw_entry)


def unregister() -> None:
    """Take both away again."""
    bpy.types.VIEW3D_MT_object_context_menu.remove(draw_entry)
    bpy.types.VIEW3D_MT_object.remove(draw_entry)
    bpy.utils.unregister_class(VIEW3D_MT_eso_lod)
