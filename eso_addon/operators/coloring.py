# SPDX-License-Identifier: GPL-3.0-or-later
"""From figures at vertices to what the viewport shows, and to an attribute of the mesh."""

import bpy
import numpy as np
from numpy.typing import NDArray

from ..bridge.attributes import write_attribute
from ..bridge.read_mesh import MeshArrays
from .colors import ramp
from .shown import Overlay, show

# The few values at both ends are not worth half of the colours.
_ENDS = (1, 99)


def overlay_of_values(
    kind: str, obj: bpy.types.Object, source: MeshArrays, values: NDArray[np.float64], title: str
) -> Overlay:
    """Show values of an object's vertices as colours.

    Parameters
    ----------
    kind : str
        Of the overlay.
    obj : bpy.types.Object
    source : MeshArrays
        What was read of it.
    values : ndarray, (n,) float64
        A value at each vertex.
    title : str
        What the values are, for the legend.

    Returns
    -------
    Overlay
    """
    finite = values[np.isfinite(values)]
    low, high = np.percentile(finite, _ENDS) if len(finite) else (0.0, 0.0)
    least = max(low, high * 1e-4, 1e-300)  # in equal factors: few vertices have most of the weight
    colors = ramp(np.log(np.nan_to_num(values).clip(least)), float(np.log(least)), float(np.log(max(high, least))))
    overlay = Overlay(
        kind, obj.name, in_object_space(source.vertices, source), source.triangles.astype(np.int32), colors,
        title=title, low=f"{least if len(finite) else 0:.3g}", high=f"{high:.3g}",
    )  # fmt: skip
    show(overlay)
    return overlay


def in_object_space(points: NDArray[np.float64], source: MeshArrays) -> NDArray[np.float32]:
    """Give points as the object's own coordinates, (..., 3) float32."""
    back = np.linalg.inv(source.transform)
    return (points @ back[:3, :3].T + back[:3, 3]).astype(np.float32)


def keep_as_attribute(obj: bpy.types.Object, name: str, values: NDArray[np.float64]) -> bool:
    """Write values as a vertex attribute; not where the mesh is linked, edited, or has other vertices."""
    mesh = obj.data
    if mesh.library is not None or mesh.is_editmode or len(mesh.vertices) != len(values):
        return False
    write_attribute(mesh, name, "FLOAT", "POINT", values)
    mesh.update()
    return True
