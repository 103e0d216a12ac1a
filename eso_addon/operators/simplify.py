# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes one version of the active mesh with fewer triangles."""

from typing import TYPE_CHECKING, Any

import bpy

from ..bridge import objects
from ..bridge.modifiers import live_modifiers
from ..core.errors import MeshError
from ..jobs.modal import EngineOperator
from ..jobs.replay import replayed_steps
from ..jobs.worker import Steps
from ..settings.options import SimplifyOptions
from .polls import poll_with, why_not_simplify
from .probing import known_error, probe_later, with_errors_if_run
from .reports import error_text, notes_of, tell, tell_error, triangles

if TYPE_CHECKING:
    from ..core.levels import SimplifyResult


_LIVE = {"ARMATURE"}


class SimplifyReading(EngineOperator, SimplifyOptions):
    """What Simplify and the level slider share: read the active mesh, run the engine or replay its last run."""

    _object: bpy.types.Object
    _source: Any  # MeshArrays
    _live: list[str]

    def prepare(self, context: bpy.types.Context) -> "Steps[list[SimplifyResult]]":
        """Read the active mesh."""
        from ..bridge.read_mesh import read_mesh

        self._object = context.active_object
        reason = objects.why_not_in_place(self._object) if self.in_place else ""
        if reason:
            raise MeshError(reason)
        if self.in_place and self.all_users and self.apply_modifiers:
            self._check_users()
        self._live = live_modifiers(self._object, _LIVE) if self.apply_modifiers else []
        self._source = read_mesh(self._object, apply_modifiers=self.apply_modifiers, live=self._live, carry=True,
                                 selection=self.only_selected and self._object.mode == "EDIT")
        targets, regions = self._asked()
        arrays = self._source.vertices, self._source.triangles
        options = {**self.engine_options(), **self._source.carried, **regions}
        return with_errors_if_run(replayed_steps(*arrays, targets=targets, options=options))

    def _check_users(self) -> None:
        """Refuse to put modifiers into a mesh that others show through modifiers of their own."""
        from ..bridge.alike import alike

        users = [self._object, *(obj for obj in bpy.data.objects if obj.data == self._object.data != obj)]
        first, *others = alike(dict.fromkeys(users), apply_modifiers=True, live_types=_LIVE)
        if others:
            raise MeshError(f"'{others[0][0].name}' shows the mesh through other modifiers than '{first[0].name}': "
                            "turn All Users or Apply Modifiers off")

    def _asked(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Give the target, and the engine's options for parts that are treated apart."""
        from ..bridge.regions import group_options, outside_selection, target_for_selection
        from ..core.screen import extent_of

        source, target, regions = self._source, self.simplify_target(), {}
        if self.target == "screen":
            extent = extent_of(source.vertices, source.triangles)
            target = {"max_error": self.screen().error_at(extent, self.screen_size)}
        if self.vertex_group:
            regions = group_options(source, self.vertex_group, use=self.group_use, factor=self.group_factor,
                                    invert=self.invert_group)
        outside = outside_selection(source)
        if outside is not None:
            regions["locked"] = outside | regions.get("locked", False)
            target = target_for_selection(source, target)
        return {f"{name}s": [value] for name, value in target.items()}, regions


class OBJECT_OT_eso_simplify(SimplifyReading, bpy.types.Operator):
    """Make a version of the active mesh with fewer triangles that keeps its shape and features"""

    bl_idname = "object.eso_simplify"
    bl_label = "ESO Simplify"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need an active mesh object."""
        return poll_with(cls, why_not_simplify(context))

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the redo panel; with refit it says how long each change takes."""
        self.layout.use_property_split = True
        self.draw_target(self.layout)
        self.layout.prop(self, "in_place")
        if self.in_place:
            self.layout.prop(self, "all_users")
        self.layout.prop(self, "only_selected")
        self.draw_keep(self.layout)
        self.draw_engine(self.layout)
        if self.refit and self.preset == "default":
            seconds = context.window_manager.eso_last_run.seconds
            self.layout.label(text=f"Refit: {seconds:.1f} s", icon="TIME", translate=False)

    def finish(self, context: bpy.types.Context, results: "list[SimplifyResult]") -> None:
        """Write the result beside the source, or in its place."""
        from ..bridge.write_mesh import write_mesh

        result, obj = results[0], self._object
        before, after, error = len(self._source.triangles), len(result.faces), known_error(result)
        objects.leave_edit_mode(obj)
        mesh = write_mesh(result, self._source, f"{obj.data.name}_ESO", **self.writing())
        if self.in_place:
            objects.replace_mesh(obj, mesh, modifiers_applied=self.apply_modifiers, all_users=self.all_users,
                                 live=self._live)
        else:
            new = objects.add_object(
                obj,
                mesh,
                f"{obj.name}_ESO",
                objects.collections_for(obj, context.scene),
                modifiers_applied=self.apply_modifiers,
                live=self._live,
                properties=objects.result_properties(obj, before, after, error),
            )
            objects.select_only([new], context.view_layer)
            objects.join_local_view([new], context.space_data)
            if self.hide_others:
                objects.hide([obj], context.view_layer)
        figures = [triangles(before, after), error_text(error), f"{self.seconds:.2f} s"]
        context.window_manager.eso_last_run.seconds = self.seconds
        tell(self, context, f"Simplified {obj.name}", figures, notes_of(self._source.left_behind, result))
        if error is None:  # a replay is shown at once, its error follows
            name = obj.name if self.in_place else new.name
            probe_later(result, lambda found: tell_error(name, found))


OPERATOR = OBJECT_OT_eso_simplify
