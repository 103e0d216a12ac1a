# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that reads a progressive stream, at a level that is chosen."""

import time
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..bridge.objects import select_only
from ..core.errors import MeshError
from ..jobs.refusal import refuse
from ..progressive.errors import StreamError
from .reports import tell
from .stream_level import remember


class IMPORT_MESH_OT_esopm(bpy.types.Operator, ImportHelper):
    """Read a progressive mesh, whole or at a coarser level"""

    bl_idname = "import_mesh.esopm"
    bl_label = "Import ESO Progressive Mesh"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filename_ext = ".esopm"
    filter_glob: StringProperty(default="*.esopm", options={"HIDDEN"})
    level: EnumProperty(
        name="Level", default="ALL",
        items=(("ALL", "Original", "The original, exactly"),
               ("PERCENT", "Percent", "A part of the original's triangles"),
               ("FACES", "Triangles", "So many triangles at most, of all objects together")))
    percent: FloatProperty(
        name="Percent", description="Of the original's triangles", subtype="PERCENTAGE", default=10.0, min=0.0,
        max=100.0)
    faces: IntProperty(
        name="Triangles", description="Of all objects together; each mesh has at least its base", default=10000, min=1)
    partial: BoolProperty(
        name="Damaged Files Too", description="Of a damaged file, read what is good before the damage")

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the level; in the redo panel it is a slider."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "level")
        if self.level != "ALL":
            layout.prop(self, "percent" if self.level == "PERCENT" else "faces", slider=self.level == "PERCENT")
        layout.prop(self, "partial")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read the file and add its objects."""
        from ..bridge.stream_objects import add_objects, loaded_scene

        started = time.perf_counter()
        path = Path(bpy.path.abspath(self.filepath))
        try:
            scene = loaded_scene(path, partial=self.partial)
            faces = {"ALL": None, "FACES": self.faces,
                     "PERCENT": max(round(scene.face_count * self.percent / 100), 1)}[self.level]
            if faces is not None and faces >= scene.face_count:
                faces = None
            levels = scene.levels(faces=faces)
            objects = add_objects(scene, levels, context.collection)
        except (MeshError, StreamError, OSError) as error:
            return refuse(self, error)
        remember(objects, path, scene, levels)
        select_only(objects, context.view_layer)
        count = sum(len(level.faces) for level in levels)
        tell(self, context, f"Imported {path.name}",
             [f"{count:,} of {scene.face_count:,} triangles", f"{time.perf_counter() - started:.2f} s"],
             [scene.damage] if scene.damage else [])
        return {"FINISHED"}


OPERATOR = IMPORT_MESH_OT_esopm
