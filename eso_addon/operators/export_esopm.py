# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that writes mesh objects as one progressive stream."""

import time
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..core.errors import MeshError
from ..core.steps import run_to_end, scaled
from ..files.atomic import check_place
from ..jobs.refusal import refuse
from ..progressive.errors import StreamError
from .polls import poll_with
from .reports import tell


class EXPORT_MESH_OT_esopm(bpy.types.Operator, ExportHelper):
    """Write meshes as a small base and patches that lead back to the original, without loss"""

    bl_idname = "export_mesh.esopm"
    bl_label = "Export ESO Progressive Mesh"
    bl_options = {"PRESET"}

    filename_ext = ".esopm"
    filter_glob: StringProperty(default="*.esopm", options={"HIDDEN"})
    use_selection: BoolProperty(
        name="Selected Only", description="Write selected objects only, not all that are visible")
    apply_modifiers: BoolProperty(
        name="Apply Modifiers", description="Write meshes as modifiers leave them", default=True)
    quantise: BoolProperty(
        name="Quantise", description="Round positions to a grid: smaller, but not exact any more")
    bits: IntProperty(
        name="Bits", description="The longest side of each mesh has two to the power of so many steps",
        default=14, min=4, max=24, soft_min=10, soft_max=20)
    keep_order: BoolProperty(
        name="Keep Order", description="Vertices and faces come back in the same order; takes a third more")
    web_page: BoolProperty(
        name="Web Page", description="Also write one HTML file that shows the meshes and holds them")
    method: EnumProperty(
        name="Method", description="Which edges are collapsed first", default="qem",
        items=(("qem", "Quadrics", "Plain quadrics: best levels where vertices stay in their place"),
               ("eso", "ESO", "Weighted by the surface variation of some rings"),
               ("so", "SO", "Weighted by the surface variation of one ring"),
               ("feature", "Feature", "Chen and Nishita: flattest edges first")))
    base_percent: FloatProperty(
        name="Base", description="Triangles of the coarsest level", subtype="PERCENTAGE", default=0.2, min=0.001,
        max=100, soft_max=20, precision=3)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need a mesh in the scene."""
        there = any(obj.type == "MESH" for obj in context.view_layer.objects)
        return poll_with(cls, "" if there else "There is no mesh in the scene: add one")

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the options beside the file list."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in ("use_selection", "apply_modifiers", "keep_order", "web_page", "method", "base_percent",
                     "quantise"):
            layout.prop(self, name)
        row = layout.column()
        row.active = self.quantise
        row.prop(self, "bits")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read the objects, make the stream, write it in one step."""
        from ..bridge.stream_objects import mesh_objects, read_objects, stream_steps
        from ..progressive.container import base_bytes
        from ..viewer.page import write_page

        started = time.perf_counter()
        path = Path(bpy.path.abspath(self.filepath))
        chosen = mesh_objects(context, selected=self.use_selection)
        manager = context.window_manager
        manager.progress_begin(0, 1)
        try:
            check_place(path)
            if self.web_page:
                check_place(path.with_suffix(".html"), unlike=[path])
            meshes, meta = read_objects(chosen, apply_modifiers=self.apply_modifiers, keep_order=self.keep_order)
            steps = stream_steps(meshes, meta, {"method": self.method, "ratio": self.base_percent / 100})
            scene = run_to_end(scaled(steps, manager.progress_update))
            size = scene.save(path, bits=self.bits if self.quantise else None, keep_order=self.keep_order)
            if self.web_page:
                write_page(path, path.with_suffix(".html"))
        except (MeshError, StreamError, OSError) as error:
            return refuse(self, error)
        finally:
            manager.progress_end()
        vertices = sum(mesh.vertex_count for mesh in scene.meshes)
        base = base_bytes(path.read_bytes())
        lost = sorted({name for mesh in meshes for name in mesh.left_behind})
        figures = [f"{scene.face_count:,} triangles", f"base {base:,} bytes",
                   f"whole {size:,} bytes ({size / max(vertices, 1):.1f} a vertex)",
                   f"{time.perf_counter() - started:.2f} s"]
        notes = [f"Not carried: {', '.join(lost)}"] if lost else []
        tell(self, context, f"Exported {path.name}", figures, notes)
        return {"FINISHED"}


OPERATOR = EXPORT_MESH_OT_esopm
