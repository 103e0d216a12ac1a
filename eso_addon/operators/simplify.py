# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes one version of the active mesh with fewer triangles."""

import bpy

from ..bridge import objects
from ..bridge.read_mesh import MeshArrays, read_mesh
from ..bridge.write_mesh import write_mesh
from ..core.levels import SimplifyResult
from ..core.mesh import MeshError
from ..core.simplify import simplify_steps
from ..jobs.modal import EngineOperator
from ..jobs.worker import Steps
from ..settings.options import SimplifyOptions
from .polls import poll_with, why_not_simplify
from .probing import with_errors
from .reports import notes_of, tell, triangles


class OBJECT_OT_eso_simplify(EngineOperator, SimplifyOptions, bpy.types.Operator):
    """Make a version of the active mesh with fewer triangles that keeps its shape and features"""

    bl_idname = "object.eso_simplify"
    bl_label = "ESO Simplify"
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
        self.draw_target(self.layout)
        self.layout.prop(self, "in_place")
        if self.in_place:
            self.layout.prop(self, "all_users")
        self.draw_engine(self.layout)

    def prepare(self, context: bpy.types.Context) -> Steps[SimplifyResult]:
        """Read the active mesh."""
        self._object = context.active_object
        reason = objects.why_not_in_place(self._object) if self.in_place else ""
        if reason:
            raise MeshError(reason)
        self._source = read_mesh(self._object, apply_modifiers=self.apply_modifiers)
        target, options = self.simplify_target(), self.engine_options()
        return with_errors(simplify_steps(self._source.vertices, self._source.triangles, **target, **options))

    def finish(self, context: bpy.types.Context, result: SimplifyResult) -> None:
        """Write the result beside the source, or in its place."""
        obj, before, after = self._object, len(self._source.triangles), len(result.faces)
        objects.leave_edit_mode(obj)
        mesh = write_mesh(result, self._source, f"{obj.data.name}_ESO")
        if self.in_place:
            objects.replace_mesh(obj, mesh, modifiers_applied=self.apply_modifiers, all_users=self.all_users)
        else:
            new = objects.add_object(
                obj,
                mesh,
                f"{obj.name}_ESO",
                objects.collections_for(obj, context.scene),
                modifiers_applied=self.apply_modifiers,
                properties=objects.result_properties(obj, before, after, result.error),
            )
            objects.select_only([new], context.view_layer)
            objects.join_local_view([new], context.space_data)
        lines = [triangles(before, after), f"error {result.error:.3g}", f"{self.seconds:.2f} s"]
        tell(self, context, f"Simplified {obj.name}", lines, notes_of(self._source.left_behind, result))


OPERATOR = OBJECT_OT_eso_simplify
