# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that makes levels again, in place, from what they say about themselves."""

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..bridge import level_info
from ..bridge.copies import follow_modifiers
from ..bridge.fingerprint import has_same_modifiers
from ..core.errors import MeshError
from ..core.steps import scaled
from ..jobs.modal import EngineOperator
from ..jobs.worker import Steps
from .lod_polls import why_not_update
from .polls import poll_with
from .reports import notes_of, tell

if TYPE_CHECKING:
    from ..core.chains import Chain

_WHICH = (
    ("SELECTED", "Selected", "Levels of the selected objects, which may be sources or levels"),
    ("ALL", "All", "All levels in the file"),
)


class OBJECT_OT_eso_lod_update(EngineOperator, bpy.types.Operator):
    """Make levels of detail again, in place, with the settings that they were made with"""

    bl_idname = "object.eso_lod_update"
    bl_label = "ESO Update LODs"
    bl_options = {"REGISTER", "UNDO"}

    which: EnumProperty(name="Of", items=_WHICH, default="ALL")
    only_stale: BoolProperty(
        name="Only Stale", description="Leave levels alone whose source is as it was", default=True
    )

    _sources: list[tuple[Any, Any]]  # LodSource and LodSettings

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need levels."""
        return poll_with(cls, why_not_update(context))

    def prepare(self, context: bpy.types.Context) -> "Steps[list[Chain]]":
        """Read the sources of the levels, those with the same settings and the same mesh together."""
        from ..bridge.lod_sources import has_group, read_sources
        from ..settings.lod_record import LodSettings

        self._sources = []
        by_settings: dict[str, list[bpy.types.Object]] = {}
        for source in self._chosen(context):
            level = level_info.levels_of(source)[0]
            by_settings.setdefault(str(level.get(level_info.SETTINGS, "")), []).append(source)
        for group in by_settings.values():
            level = level_info.levels_of(group[0])[0]
            settings = LodSettings.read(level_info.settings_of(level))
            read = read_sources(group, apply_modifiers=settings.apply_modifiers, live_types=settings.live)
            for source in read:
                if settings.group and not has_group(source, settings.group):
                    raise MeshError(f"'{source.objects[0].name}' has no vertex group "
                                    f"'{settings.group['vertex_group']}' any more, which its levels were made with: "
                                    "bring the name back, or generate them anew")
            self._sources += [(source, settings) for source in read]
        return self._steps()

    def finish(self, context: bpy.types.Context, result: "list[Chain]") -> None:
        """Put the new meshes in the place of the old ones."""
        from ..bridge.lod_sources import told_of, write_chains
        from ..bridge.place_levels import put_mesh

        lines, notes = [], []
        written = [
            write_chains([source], [chain], [["eso_lod new level"] * len(chain.levels)], settings.writing)[0]
            for (source, settings), chain in zip(self._sources, result, strict=True)
        ]
        for (source, settings), chain, new in zip(self._sources, result, written, strict=True):
            stored = level_info.settings_text(settings.stored([]))
            for obj in source.objects:
                own = [told_of(level, obj, stored, settings.profile) for level in new]
                for level in level_info.levels_of(obj):
                    made = own[min(level[level_info.LEVEL], len(own) - 1)]
                    put_mesh(level, made.mesh)
                    if not has_same_modifiers(obj, str(level.get(level_info.HASH, ""))):
                        follow_modifiers(level, obj, modifiers_applied=settings.apply_modifiers, live=source.live)
                    for key, value in made.properties.items():
                        if key != level_info.LEVEL:
                            level[key] = value
            for level in new:  # of a level that was deleted
                if not level.mesh.users:
                    bpy.data.meshes.remove(level.mesh)
            counts = ", ".join(f"{len(level.result.faces):,}" for level in chain.levels)
            lines.append(f"{source.objects[0].name}: {counts} triangles")
            notes += notes_of(source.arrays.left_behind, chain)
        tell(self, context, "Updated levels", [*(lines or ["all were up to date"]), f"{self.seconds:.2f} s"],
             dict.fromkeys(notes))

    def _steps(self) -> "Generator[float, None, list[Chain]]":
        from ..bridge.lod_sources import engine_inputs
        from ..core.chains import chains_steps

        chains: list[Chain] = []
        for number, (source, settings) in enumerate(self._sources):
            mesh = source.arrays.vertices, source.arrays.triangles
            steps = chains_steps([mesh], settings.goals(), [settings.options(engine_inputs(source, settings.group))])
            chains += yield from scaled(steps, lambda part, number=number: (number + part) / len(self._sources))
        return chains

    def _chosen(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        """List the sources whose levels are to be made again."""
        things = bpy.data.objects if self.which == "ALL" else context.selected_objects
        sources: dict[bpy.types.Object, None] = {}
        for obj in things:
            if level_info.is_level(obj):
                source = level_info.find_source(obj)
                if source is None and self.which != "ALL":
                    raise MeshError(f"'{obj[level_info.SOURCE]}', the source of '{obj.name}', is gone: bring it back")
                if source is not None:
                    sources[source] = None
            elif obj.type == "MESH" and level_info.levels_of(obj):
                sources[obj] = None
        if self.only_stale:
            return [obj for obj in sources if level_info.stale_ones(level_info.levels_of(obj))]
        return list(sources)


OPERATOR = OBJECT_OT_eso_lod_update
