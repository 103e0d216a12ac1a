# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive meshes in the File menus, in the object context menu, and the slider of an imported one."""

import bpy


class VIEW3D_PT_eso_stream_level(bpy.types.Panel):
    """The level of an imported stream."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "ESO"
    bl_label = "Imported Stream"
    bl_parent_id = "VIEW3D_PT_eso_stream"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need an object from a stream."""
        obj = context.active_object
        return obj is not None and obj.type == "MESH" and bool(obj.eso_stream.path)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the slider."""
        stream, layout = context.active_object.eso_stream, self.layout
        layout.prop(stream, "percent", slider=True)
        shown = len(context.active_object.data.polygons)
        layout.label(text=f"{shown:,} faces shown, {stream.faces:,} triangles in all")
        layout.prop(stream, "path")
        if stream.trouble:
            layout.label(text=stream.trouble, icon="ERROR")


def draw_export(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry of File > Export."""
    self.layout.operator("export_mesh.esopm", text="ESO Progressive Mesh (.esopm)")


def draw_import(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry of File > Import."""
    self.layout.operator("import_mesh.esopm", text="ESO Progressive Mesh (.esopm)")


def draw_context(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entry of the object context menu."""
    if context.active_object is not None and context.active_object.type == "MESH":
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator("export_mesh.esopm", text="ESO Progressive Mesh (.esopm)").use_selection = True


def register() -> None:
    """Add the panel and the entries."""
    bpy.utils.register_class(VIEW3D_PT_eso_stream_level)
    bpy.types.TOPBAR_MT_file_export.append(draw_export)
    bpy.types.TOPBAR_MT_file_import.append(draw_import)
    bpy.types.VIEW3D_MT_object_context_menu.append(draw_context)


def unregister() -> None:
    """Take them away again."""
    bpy.types.VIEW3D_MT_object_context_menu.remove(draw_context)
    bpy.types.TOPBAR_MT_file_import.remove(draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(draw_export)
    bpy.utils.unregister_class(VIEW3D_PT_eso_stream_level)
