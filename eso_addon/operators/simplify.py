# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes one version of the active mesh with fewer triangles."""

import bpy

from ..bridge import objects
from ..bridge.read_mesh import MeshArrays, read_mesh
from ..bridge.write_mesh import write_mesh
from ..core.levels import SimplifyResult
from ..core.mesh import MeshError
from ..jobs.modal import EngineOperator
from ..jobs.replay import replayed_steps
from ..jobs.worker import Steps
from ..settings.options import SimplifyOptions
from .polls import poll_with, why_not_simplify
from .probing import known_error, probe_later, with_errors_if_run
from .reports import error_text, notes_of, tell, tell_error, triangles


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

    def prepare(self, context: bpy.types.Context) -> Steps[list[SimplifyResult]]:
        """Read the active mesh."""
        self._object = context.active_object
        reason = objects.why_not_in_place(self._object) if self.in_place else ""
        if reason:
            raise MeshError(reason)
        self._source = read_mesh(self._object, apply_modifiers=self.apply_modifiers, carry=True)
        targets = {f"{name}s": [value] for name, value in self.simplify_target().items()}
        arrays = self._source.vertices, self._source.triangles
        options = {**self.engine_options(), **self._source.carried}
        return with_errors_if_run(replayed_steps(*arrays, targets=targets, options=options))

    def finish(self, context: bpy.types.Context, results: list[SimplifyResult]) -> None:
        """Write the result beside the source, or in its place."""
        result, obj = results[0], self._object
        before, after, error = len(self._source.triangles), len(result.faces), known_error(result)
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
                properties=objects.result_properties(obj, before, after, error),
            )
            objects.select_only([new], context.view_layer)
            objects.join_local_view([new], context.space_data)
        figures = [triangles(before, after), error_text(error), f"{self.seconds:.2f} s"]
        tell(self, context, f"Simplified {obj.name}", figures, notes_of(self._source.left_behind, result))
        if error is None:  # a replay is shown at once, its error follows
            name = obj.name if self.in_place else new.name
            probe_later(result, lambda found: tell_error(name, found))


OPERATOR = OBJECT_OT_eso_simplify
