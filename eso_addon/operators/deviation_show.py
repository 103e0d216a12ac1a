# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that shows how far each place of a simplified mesh is from its original, as colours."""

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import bpy

from ..jobs.modal import EngineOperator
from .polls import measured_pair, poll_with, why_not_measure
from .reports import tell

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..bridge.read_mesh import MeshArrays

    Found = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]

# Points at which the simplified surface is compared: large triangles are divided for it.
_POINTS = 120_000


class OBJECT_OT_eso_deviation_show(EngineOperator, bpy.types.Operator):
    """Colour the active mesh by its distance from the original: the other selected mesh, or the one it was made from"""

    bl_idname = "object.eso_deviation_show"
    bl_label = "ESO Show Deviation"
    bl_options = {"REGISTER"}

    _object: bpy.types.Object
    _source: Any  # MeshArrays

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need two meshes."""
        return poll_with(cls, why_not_measure(context))

    def prepare(self, context: bpy.types.Context) -> "Generator[float, None, Found]":
        """Read both meshes."""
        from ..bridge.read_mesh import read_mesh

        original, self._object = measured_pair(context)
        self._source = read_mesh(self._object)
        return _distances(read_mesh(original), self._source)

    def finish(self, context: bpy.types.Context, result: "Found") -> None:
        """Show the colours."""
        import numpy as np

        from .coloring import in_object_space
        from .colors import ramp
        from .shown import Overlay, show

        points, faces, distances = result
        most = float(distances.max(initial=0.0))
        places = in_object_space(points, self._source)
        colors = ramp(distances, 0.0, most)
        low, high = "0", f"{most:.3g}"
        overlay = Overlay("deviation", self._object.name, places, faces.astype(np.int32), colors,
                          title="Distance from the original", low=low, high=high)  # fmt: skip
        show(overlay)
        figures = [f"max {high}", f"mean {distances.mean():.3g}", f"{self.seconds:.2f} s"]
        tell(self, context, f"Deviation of {self._object.name}", figures)


OPERATOR = OBJECT_OT_eso_deviation_show


def _distances(original: "MeshArrays", simplified: "MeshArrays") -> "Generator[float, None, Found]":
    """Divide the simplified mesh evenly and find the distance of every point from the original."""
    import numpy as np

    from ..core.closest import ClosestPoints
    from ..core.mesh import MeshError
    from ..core.steps import scaled

    yield 0.0
    if not len(original.triangles):
        raise MeshError("the original has no faces: there is no surface to compare with")
    if not len(simplified.triangles):
        raise MeshError("the active mesh has no faces: there is nothing to show")
    sides = int(np.clip(np.sqrt(2 * _POINTS / len(simplified.triangles)) - 1, 1, 24))
    points, faces = divided(simplified.vertices, simplified.triangles, sides)
    search = ClosestPoints(original.vertices, original.triangles)
    yield 0.3
    _, _, squared = yield from scaled(search.query_steps(points), lambda _: 0.6)
    return points, faces, np.sqrt(squared)


def divided(
    vertices: "NDArray[np.float64]", triangles: "NDArray[np.int64]", sides: int
) -> "tuple[NDArray[np.float64], NDArray[np.int64]]":
    """Divide each triangle into `sides` squared ones; their vertices are each triangle's own.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    triangles : ndarray, (m, 3) int64
    sides : int
        Parts of each side.

    Returns
    -------
    points : ndarray, (m * k, 3) float64
        With k = (sides + 1) * (sides + 2) / 2.
    faces : ndarray, (m * sides ** 2, 3) int64
    """
    import numpy as np

    row, column = np.nonzero(np.tri(sides + 1, dtype=bool))  # row r has r + 1 points
    weights = np.stack([sides - row, row - column, column], axis=1) / sides
    points = (weights @ vertices[triangles]).reshape(-1, 3)
    here, inner = np.flatnonzero(row < sides), np.flatnonzero((row < sides) & (column < row))
    below = here + row[here] + 1
    upward = np.stack([here, below, below + 1], axis=1)
    under = inner + row[inner] + 2
    downward = np.stack([inner, under, inner + 1], axis=1)
    pattern = np.concatenate([upward, downward])
    starts = np.arange(len(triangles)) * len(row)
    return points, (starts[:, None, None] + pattern).reshape(-1, 3)
