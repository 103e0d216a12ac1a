# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes a chain of levels of detail of the active mesh, in one run of the engine."""

import bpy

from ..bridge import objects
from ..bridge.read_mesh import MeshArrays, read_mesh
from ..bridge.write_mesh import write_mesh
from ..core.simplify import SimplifyResult, lod_chain_steps
from ..jobs.modal import EngineOperator
from ..jobs.worker import Steps
from ..settings.lod_options import LodOptions
from .polls import poll_with, why_not_simplify
from .probing import with_errors
from .reports import notes_of, tell


class OBJECT_OT_eso_lod_generate(EngineOperator, LodOptions, bpy.types.Operator):
    """Make levels of detail of the active mesh as new objects in a collection; the mesh itself stays as it is"""

    bl_idname = "object.eso_lod_generate"
    bl_label = "ESO Generate LODs"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    _object: bpy.types.Object
    _source: MeshArrays

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need an active mesh object."""
        return poll_with(cls, why_not_simplify(context))

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the redo panel."""
        self.layout.use_property_split = True
        self.draw_levels(self.layout)
        self.draw_engine(self.layout)

    def prepare(self, context: bpy.types.Context) -> Steps[list[SimplifyResult]]:
        """Read the active mesh."""
        targets, options = self.lod_targets(), self.engine_options()
        self._object = context.active_object
        self._source = read_mesh(self._object, apply_modifiers=self.apply_modifiers)
        return with_errors(lod_chain_steps(self._source.vertices, self._source.triangles, **targets, **options))

    def finish(self, context: bpy.types.Context, result: list[SimplifyResult]) -> None:
        """Write the levels as objects, the finest first."""
        obj, before = self._object, len(self._source.triangles)
        collection = objects.level_collection(self.collection or f"{obj.name}_LODs", context.scene)
        objects.leave_edit_mode(obj)
        notes = notes_of(self._source.left_behind, *result)
        if self.replace and (removed := objects.remove_levels(obj, collection)):
            notes.append(f"Replaced {removed} earlier levels")
        levels = [
            objects.add_object(
                obj,
                write_mesh(level, self._source, f"{obj.name}_LOD{number}"),
                f"{obj.name}_LOD{number}",
                [collection],
                modifiers_applied=self.apply_modifiers,
                properties=objects.result_properties(obj, before, len(level.faces), level.error),
            )
            for number, level in enumerate(result)
        ]
        objects.select_only(levels, context.view_layer)
        objects.join_local_view(levels, context.space_data)
        counts = [len(level.faces) for level in result]
        lines = [
            f"LOD{number} {count:,} ({count / max(before, 1):.1%}), error {level.error:.3g}"
            for number, (count, level) in enumerate(zip(counts, result, strict=True))
        ]
        tell(self, context, f"Levels of {obj.name}", [f"{before:,} triangles", *lines, f"{self.seconds:.2f} s"], notes)


OPERATOR = OBJECT_OT_eso_lod_generate
