# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes levels of detail of all chosen meshes, in one run of the engine for each."""

from typing import TYPE_CHECKING, Any

import bpy

from ..bridge import level_info, objects
from ..bridge.instances import instancers, place_instances
from ..core.errors import MeshError
from ..jobs.modal import EngineOperator
from ..jobs.worker import Steps
from ..settings.lod_options import LodOptions
from ..settings.profiles import PROFILES
from .lod_polls import chosen_objects, why_not_generate
from .polls import poll_with
from .reports import notes_of, tell

if TYPE_CHECKING:
    from ..core.chains import Chain


class OBJECT_OT_eso_lod_generate(EngineOperator, LodOptions, bpy.types.Operator):
    """Make levels of detail of the selected meshes as new objects in collections; the meshes stay as they are"""

    bl_idname = "object.eso_lod_generate"
    bl_label = "ESO Generate LODs"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    _settings: Any  # LodSettings
    _sources: list[Any]  # LodSource
    _places: list[Any]  # Place
    _empties: list[bpy.types.Object]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need meshes, or a collection that may have some."""
        return poll_with(cls, why_not_generate(context))

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the redo panel."""
        self.layout.use_property_split = True
        self.draw_levels(self.layout)
        self.draw_keep(self.layout)
        self.draw_engine(self.layout)

    def prepare(self, context: bpy.types.Context) -> "Steps[list[Chain]]":
        """Read the meshes, and see that their levels will have names and places."""
        from ..bridge.lod_sources import check_group, engine_inputs, meshes_behind, read_sources
        from ..bridge.place_levels import plan_places
        from ..core.chains import chains_steps

        self._settings = self.lod_settings()
        goals = self._settings.goals()
        chosen = self._chosen(context)
        self._empties = instancers(chosen)
        self._sources = read_sources(
            meshes_behind(chosen), apply_modifiers=self.apply_modifiers, live_types=self._settings.live
        )
        if not self._sources:
            raise MeshError("no mesh with faces is chosen: select one, or choose a collection that has some")
        everyone = [obj for source in self._sources for obj in source.objects]
        name = PROFILES[self.profile].scene_name
        self._places = plan_places(
            everyone, len(goals.values), name, collection=self.collection, replace=self.replace
        )
        meshes = [(source.arrays.vertices, source.arrays.triangles) for source in self._sources]
        check_group(self._sources, self._settings.group)
        inputs = [engine_inputs(source, self._settings.group) for source in self._sources]
        options = [self._settings.options(own) for own in inputs]
        return chains_steps(meshes, goals, options, [len(source.objects) for source in self._sources])

    def finish(self, context: bpy.types.Context, result: "list[Chain]") -> None:
        """Write the levels as objects, the finest first."""
        from ..bridge.lod_sources import has_group, name_meshes, told_of, write_chains
        from ..bridge.place_levels import place_levels

        place_of = {place.source: place for place in self._places}
        made: list[bpy.types.Object] = []
        names_of = [place_of[source.objects[0]].names for source in self._sources]
        written = write_chains(self._sources, result, names_of, self._settings.writing)
        for source, chain, levels, names in zip(self._sources, result, written, names_of, strict=True):
            settings = level_info.settings_text(self._settings.stored(
                [len(level.result.faces) for level in chain.levels], with_group=has_group(source, self._settings.group)
            ))
            for obj in source.objects:
                objects.leave_edit_mode(obj)
                own = [told_of(level, obj, settings, self.profile) for level in levels]
                made += place_levels(
                    place_of[obj], own, context.scene, modifiers_applied=self.apply_modifiers, live=source.live
                )
            name_meshes(levels, names)
        made += place_instances(self._empties, PROFILES[self.profile].scene_name, context.scene)
        objects.select_only(made, context.view_layer)
        objects.join_local_view(made, context.space_data)
        if self.hide_others:
            coarser = [obj for obj in made if obj.get(level_info.LEVEL)]
            objects.hide([*place_of, *self._empties, *coarser], context.view_layer)
        self._tell(context, result)

    def _chosen(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        if self.scope == "COLLECTION":
            return list(_collection(context, self.source_collection).all_objects)
        return chosen_objects(context)

    def _tell(self, context: bpy.types.Context, chains: "list[Chain]") -> None:
        lines = []
        for source, chain in zip(self._sources, chains, strict=True):
            before, many = len(source.arrays.triangles), len(self._sources) > 1
            lines.append(f"{source.objects[0].name}: {before:,} triangles" if many else f"{before:,} triangles")
            lines += [
                f"{self._label(number)} {len(level.result.faces):,} "
                f"({len(level.result.faces) / max(before, 1):.1%}), error {level.result.error:.3g}, "
                f"from {level.distance:.3g} on"
                for number, level in enumerate(chain.levels)
            ]
        if len(self._sources) > _MOST_TOLD:
            lines = self._sums(chains)
        notes = [note for source, chain in zip(self._sources, chains, strict=True)
                 for note in notes_of(source.arrays.left_behind, chain)]
        title = f"Levels of {self._sources[0].objects[0].name}"
        more = len(self._places) - 1
        tell(self, context, title + (f" and {more} more" if more else ""), [*lines, f"{self.seconds:.2f} s"],
             dict.fromkeys(notes))

    def _label(self, number: int) -> str:
        return PROFILES[self.profile].scene_name("", number).lstrip("_")

    def _sums(self, chains: "list[Chain]") -> list[str]:
        """Give for each level the triangles of all objects together; those with fewer levels count with their last."""
        copies = [len(source.objects) for source in self._sources]
        most = max(len(chain.levels) for chain in chains)
        sums = [sum(len(chain.levels[min(number, len(chain.levels) - 1)].result.faces) * times
                    for chain, times in zip(chains, copies, strict=True)) for number in range(most)]
        before = sum(len(source.arrays.triangles) * times for source, times in zip(self._sources, copies, strict=True))
        return [f"{before:,} triangles in all",
                *(f"{self._label(number)} {total:,} ({total / before:.1%})" for number, total in enumerate(sums))]


OPERATOR = OBJECT_OT_eso_lod_generate
_MOST_TOLD = 4  # objects whose levels are listed one by one


def _collection(context: bpy.types.Context, name: str) -> bpy.types.Collection:
    if not name:
        return context.collection
    collection = bpy.data.collections.get(name)
    if collection is None:
        raise MeshError(f"there is no collection '{name}': choose one that is there")
    return collection
