# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that shows the weights of the active mesh's vertices as colours (Figure 11 of the paper)."""

from collections.abc import Generator
from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty, IntProperty

from .active_mesh import ActiveMeshOperator
from .reports import tell

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..bridge.read_mesh import MeshArrays

ATTRIBUTE = "eso_weight"
_METHODS = (
    ("eso", "ESO", "Surface variation within several rings of neighbours"),
    ("so", "SO", "Surface variation within one ring"),
)


class OBJECT_OT_eso_weights_show(ActiveMeshOperator, bpy.types.Operator):
    """Show what guides the simplifier: high weights keep their triangles. Kept in the vertex attribute eso_weight"""

    bl_idname = "object.eso_weights_show"
    bl_label = "ESO Show Weights"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    method: EnumProperty(name="Method", description="Which weights", items=_METHODS, default="eso")
    rings: IntProperty(
        name="Rings",
        description="Rings of neighbours that an ESO weight looks at",
        default=3,
        min=1,
        max=16,
        soft_max=8,
    )

    def prepare(self, context: bpy.types.Context) -> "Generator[float, None, NDArray[np.float64]]":
        """Read the active mesh."""
        self.read(context)
        return _weigh(self._source, self.method, self.rings)

    def finish(self, context: bpy.types.Context, result: "NDArray[np.float64]") -> None:
        """Show the colours, and keep the weights as an attribute where the vertices are the mesh's own."""
        from .coloring import keep_as_attribute, overlay_of_values

        overlay = overlay_of_values("weights", self._object, self._source, result, "ESO weight")
        kept = keep_as_attribute(self._object, ATTRIBUTE, result)
        figures = [f"{overlay.low} to {overlay.high}", f"{self.seconds:.2f} s"]
        notes = [] if kept else ["The vertices are not the mesh's own: shown, not kept"]
        tell(self, context, f"Weights of {self._object.name}", figures, notes)


OPERATOR = OBJECT_OT_eso_weights_show


def _weigh(source: "MeshArrays", method: str, rings: int) -> "Generator[float, None, NDArray[np.float64]]":
    from ..core.variation import vertex_weights

    yield 0.0
    return vertex_weights(source.vertices, source.triangles, method=method, rings=rings)
