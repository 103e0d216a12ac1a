# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that bakes normal maps of the coarser levels from the finest."""

import time

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..bridge import level_info, objects
from ..core.errors import MeshError
from ..jobs.refusal import refuse
from ..settings.profiles import PROFILES
from .lod_polls import chosen_objects, why_not_update
from .polls import poll_with
from .reports import tell

_FROM = (
    ("source", "Source", "The mesh that the levels were made from"),
    ("finest", "Finest Level", "The first level, as engines show it"),
)


class OBJECT_OT_eso_lod_bake(bpy.types.Operator):
    """Bake normal maps for the coarser levels of the selected objects, with Cycles"""

    bl_idname = "object.eso_lod_bake"
    bl_label = "ESO Bake Normals"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    size: IntProperty(name="Size", description="Pixels along each side of a map", default=1024, min=16, max=16384)
    detail: EnumProperty(name="From", items=_FROM, default="finest")
    reach: FloatProperty(
        name="Reach",
        description="How far the surfaces are apart at most; 0 takes twice the level's error",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    samples: IntProperty(name="Samples", description="Samples of each pixel", default=16, min=1, soft_max=256)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need levels."""
        return poll_with(cls, why_not_update(context))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the size first: baking takes its time."""
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bake level after level."""
        from ..bridge.bake import bake_normals

        start = time.perf_counter()
        try:
            pairs = self._pairs(context)
            images = [bake_normals(fine, level, self.size, self._reach(level), self.samples) for fine, level in pairs]
        except MeshError as error:
            return refuse(self, error)
        seconds = time.perf_counter() - start
        tell(self, context, "Baked normals", [*(image.name for image in images), f"{seconds:.1f} s"])
        return {"FINISHED"}

    def _pairs(self, context: bpy.types.Context) -> list[tuple[bpy.types.Object, bpy.types.Object]]:
        """Find what is baked from and to, each mesh once, and see that all of it can be."""
        from ..bridge.bake import why_not_bake
        from ..bridge.lod_sources import meshes_behind

        families = level_info.families(meshes_behind(chosen_objects(context)))
        pairs: dict[bpy.types.Mesh, tuple[bpy.types.Object, bpy.types.Object]] = {}
        for family in families:
            fine = family.levels[0] if self.detail == "finest" else family.source
            if fine is None:
                raise MeshError(f"'{family.name}', the source of these levels, is gone: bake from the finest level")
            for level in family.levels[self.detail == "finest" :]:
                profile = PROFILES.get(str(level.get(level_info.PROFILE, "")), PROFILES["plain"])
                if not profile.normal_maps:
                    raise MeshError(f"{profile.label} takes no normal map of its own for each level")
                if reason := why_not_bake(level):
                    raise MeshError(reason)
                pairs.setdefault(level.data, (fine, level))
        if not pairs:
            raise MeshError("none of the selected objects has coarser levels: generate some first")
        return list(pairs.values())

    def _reach(self, level: bpy.types.Object) -> float:
        return self.reach or max(2 * float(level.get(objects.ERROR, 0.0)), 1e-4 * max(level.dimensions))


OPERATOR = OBJECT_OT_eso_lod_bake
