# SPDX-License-Identifier: GPL-3.0-or-later
"""Names the data of a mesh that its simplified versions do not carry yet."""

from collections.abc import Iterable

import bpy
import numpy as np
from numpy.typing import NDArray

# Carried, or made anew by Blender.
_CARRIED = {"position", "material_index", "sharp_face"}


def names_left_behind(
    obj: bpy.types.Object, mesh: bpy.types.Mesh, corner_vertex: NDArray[np.integer]
) -> tuple[str, ...]:
    """List what is lost.

    Parameters
    ----------
    obj : bpy.types.Object
        The object, for its vertex groups and shape keys.
    mesh : bpy.types.Mesh
        The mesh that was read, evaluated or not.
    corner_vertex : ndarray, (corners,) integers
        The vertex of each corner.

    Returns
    -------
    names : tuple of str
        Such as ``"UV maps (UVMap)"``; empty if nothing is lost.
    """
    uv_maps = [layer.name for layer in mesh.uv_layers]
    colors = [attribute.name for attribute in mesh.color_attributes]
    keys = obj.data.shape_keys
    known = {*_CARRIED, *uv_maps, *colors, "custom_normal", "sharp_edge"}
    others = [a.name for a in mesh.attributes if a.name not in known and not a.is_internal and a.name[:1] != "."]
    found = [
        _named("UV maps", uv_maps),
        _named("vertex groups", (group.name for group in obj.vertex_groups)),
        _named("shape keys", (block.name for block in keys.key_blocks) if keys else ()),
        _named("colour attributes", colors),
        "custom normals" if mesh.has_custom_normals else "",
        "sharp edges" if "sharp_edge" in mesh.attributes else "",
        _named("attributes", others),
        "loose points and edges" if _has_loose_vertices(len(mesh.vertices), corner_vertex) else "",
    ]
    return tuple(name for name in found if name)


def _named(kind: str, names: Iterable[str]) -> str:
    listed = ", ".join(names)
    return f"{kind} ({listed})" if listed else ""


def _has_loose_vertices(count: int, corner_vertex: NDArray[np.integer]) -> bool:
    used = np.zeros(count, bool)
    used[corner_vertex] = True
    return not used.all()
