# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that adds collision hulls to levels, named for their engine."""

import bpy
from bpy.props import EnumProperty

from ..bridge import level_info, objects
from ..bridge.level_names import check_free
from ..core.errors import MeshError
from ..jobs.refusal import refuse
from ..settings.profiles import PROFILES
from .lod_polls import chosen_objects, why_not_update
from .polls import poll_with
from .reports import tell

_KINDS = (
    ("one", "One", "One hull around the whole object"),
    ("parts", "Parts", "A hull around each connected part"),
)


class OBJECT_OT_eso_lod_hulls(bpy.types.Operator):
    """Add convex collision hulls to the levels of the selected objects, named as their engine wants them"""

    bl_idname = "object.eso_lod_hulls"
    bl_label = "ESO Collision Hulls"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Hulls", items=_KINDS, default="one")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need levels."""
        return poll_with(cls, why_not_update(context))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Replace the hulls that are there."""
        from ..bridge.lod_sources import meshes_behind

        families = level_info.families(meshes_behind(chosen_objects(context)))
        try:
            if not families:
                raise MeshError("none of the selected objects has levels: generate some first")
            made = [hull for family in families for hull in self._replace(family)]
        except MeshError as error:
            return refuse(self, error)
        faces = sum(objects.triangle_count(hull) for hull in made)
        tell(self, context, f"Collision hulls of {families[0].name}",
             [f"{len(made)} hulls", f"{faces:,} triangles"])
        return {"FINISHED"}

    def _replace(self, family: level_info.Family) -> list[bpy.types.Object]:
        from ..bridge.hulls import add_hulls
        from ..bridge.place_levels import remove_with_mesh

        finest, old = family.levels[0], family.hulls
        profile = PROFILES.get(str(finest.get(level_info.PROFILE, "")), PROFILES["plain"])
        if not profile.hull:
            raise MeshError(f"{profile.label} has no names for collision hulls: make the levels for an engine that has")
        check_free([profile.hull_name(family.name, 1)], old)
        names = {hull: hull.name for hull in old}
        for hull in old:
            hull.name = "eso_lod old hull"
        try:
            made = add_hulls(family.source or finest, finest, family.name, profile.hull_name, self.kind)
        except MeshError:
            for hull, name in names.items():
                hull.name = name
            raise
        for hull in old:
            remove_with_mesh(hull)
        for hull in made:
            hull.data.name = hull.name
        return made


OPERATOR = OBJECT_OT_eso_lod_hulls
