# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that draws the sharp edges and the base edges of the active mesh (Chen and Nishita, section 3)."""

from collections.abc import Generator
from math import degrees, radians
from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty

from .active_mesh import ActiveMeshOperator
from .reports import tell

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..bridge.read_mesh import MeshArrays

    Edges = tuple[NDArray[np.int64], NDArray[np.int64]]

_SHARP, _BASE = (1.0, 0.35, 0.1, 1.0), (0.2, 0.75, 1.0, 1.0)


class OBJECT_OT_eso_edges_show(ActiveMeshOperator, bpy.types.Operator):
    """Draw the edges that the method Feature keeps: sharp edges, and base edges below epsilon"""

    bl_idname = "object.eso_edges_show"
    bl_label = "ESO Show Edges"
    bl_options = {"REGISTER", "PRESET"}

    sharp_angle: FloatProperty(
        name="Sharp Angle",
        description="Edges between faces further apart than this are sharp",
        default=radians(40),
        min=0.0,
        max=radians(180),
        subtype="ANGLE",
    )
    epsilon: FloatProperty(
        name="Epsilon",
        description="Edges whose virtual edge weighs less than this are base edges",
        default=0.5,
        min=-1.0,
        max=1.0,
    )

    def prepare(self, context: bpy.types.Context) -> "Generator[float, None, Edges]":
        """Read the active mesh."""
        self.read(context)
        return _find(self._source, degrees(self.sharp_angle), self.epsilon)

    def finish(self, context: bpy.types.Context, result: "Edges") -> None:
        """Show the lines."""
        from .coloring import in_object_space
        from .shown import Overlay, show

        sharp, base = result
        source = self._source
        points = in_object_space(source.vertices, source)
        lines = [("Sharp edges", _SHARP, points[sharp]), ("Base edges", _BASE, points[base])]
        show(Overlay("edges", self._object.name, points, source.triangles.astype("int32"), lines=lines))
        figures = [f"{len(sharp):,} sharp", f"{len(base):,} base", f"{self.seconds:.2f} s"]
        tell(self, context, f"Edges of {self._object.name}", figures)


OPERATOR = OBJECT_OT_eso_edges_show


def _find(source: "MeshArrays", angle: float, epsilon: float) -> "Generator[float, None, Edges]":
    """Find the edges; those of faces that only stand beside each other are no boundaries, so they are welded first."""
    from ..core.features import base_edges, sharp_edges
    from ..core.mesh import weld

    yield 0.0
    faces = weld(source.vertices).take(source.triangles)
    sharp = sharp_edges(source.vertices, faces, face_values=[source.material_index], angle=angle)
    yield 0.5
    return sharp, base_edges(source.vertices, faces, epsilon)
