# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""What is protected, and what becomes of polygons and weights, as Blender properties for every operator that writes."""

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

_GROUP_USES = (
    ("favour", "Favour", "Errors count for more where the group's weight is high"),
    ("protect", "Protect", "Vertices whose weight is at least one half are not touched"),
)
_GROUP = ("vertex_group", "group_use", "group_factor", "invert_group")


class KeepOptions:
    """What stays."""

    vertex_group: StringProperty(name="Vertex Group", description="Protects or favours painted regions", default="")
    group_use: EnumProperty(name="Group", items=_GROUP_USES, default="favour")
    group_factor: FloatProperty(
        name="Factor", description="How many times more errors count at full weight", default=10.0, min=0.0,
        soft_max=100.0
    )
    invert_group: BoolProperty(name="Invert", description="Use one less the weight", default=False)
    join_quads: BoolProperty(
        name="Join Quads", description="Join the triangles of changed quads again; unchanged polygons always stay",
        default=False
    )
    keep_loose: BoolProperty(name="Keep Loose", description="Keep points and edges without faces", default=True)
    influences: IntProperty(
        name="Influences", description="Bones that may move a vertex; -1: as many as in the source, 0: any number",
        default=-1, min=-1, soft_max=8
    )

    def draw_keep(self, layout: bpy.types.UILayout) -> None:
        """Draw all of it, with the active object's vertex groups to choose from."""
        obj = bpy.context.active_object
        if obj is not None and obj.type == "MESH":
            layout.prop_search(self, "vertex_group", obj, "vertex_groups")
        if self.vertex_group:
            layout.prop(self, "group_use")
            if self.group_use == "favour":
                layout.prop(self, "group_factor")
            layout.prop(self, "invert_group")
        for name in ("join_quads", "keep_loose", "influences"):
            layout.prop(self, name)

    def group_settings(self) -> dict[str, Any]:
        """Give the vertex group and what it does, as plain data; empty without one."""
        return {name: getattr(self, name) for name in _GROUP} if self.vertex_group else {}

    def writing(self) -> dict[str, Any]:
        """Give the options of `write_mesh`."""
        return {"join_quads": self.join_quads, "keep_loose": self.keep_loose,
                "influences": None if self.influences < 0 else self.influences}
