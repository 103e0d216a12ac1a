# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays as a new Blender mesh: valid, with the source's materials and smooth faces, back in object space."""

from typing import Protocol

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError
from .attributes import write_attribute
from .read_mesh import MeshArrays


class Simplified(Protocol):
    """What of the engine's result is written."""

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Positions, (k, 3)."""

    @property
    def faces(self) -> NDArray[np.int32]:
        """Vertex indices, (m, 3)."""

    @property
    def face_map(self) -> NDArray[np.int32]:
        """The source's triangle that each face comes from, (m,)."""


def write_mesh(result: Simplified, source: MeshArrays, name: str) -> bpy.types.Mesh:
    """Build a mesh datablock from a simplified mesh.

    Parameters
    ----------
    result : Simplified
        In the space of ``source.vertices``.
    source : MeshArrays
        What was simplified: its transform is undone, its materials and smooth faces are handed on by `face_map`.
    name : str
        Of the new datablock.

    Returns
    -------
    bpy.types.Mesh

    Raises
    ------
    MeshError
        A position that single precision cannot hold.
    """
    positions = _in_object_space(result.vertices, source.transform)
    mesh = bpy.data.meshes.new(name)
    for material in source.materials:
        mesh.materials.append(material)
    if len(positions):
        mesh.vertices.add(len(positions))
        write_attribute(mesh, "position", "FLOAT_VECTOR", "POINT", positions)
    if len(result.faces):
        _write_faces(mesh, result, source)
    mesh.update(calc_edges=True)
    if _has_twins(result.faces):
        mesh.validate()  # drops faces with the same three vertices: Blender has no place for them
    return mesh


def _has_twins(faces: NDArray[np.int32]) -> bool:
    """Tell whether faces share all three vertices; looking is ten times as quick as Blender's validation."""
    low, middle, high = np.sort(faces, axis=1).astype(np.uint64).T
    keys = np.sort((low * np.uint64(0x9E3779B97F4A7C15) + middle) * np.uint64(0xC2B2AE3D27D4EB4F) + high)
    return bool((keys[1:] == keys[:-1]).any())  # or one in a billion others


def _in_object_space(vertices: NDArray[np.float64], transform: NDArray[np.float64]) -> NDArray[np.float32]:
    if not np.array_equal(transform, np.eye(4)):
        back = np.linalg.inv(transform)
        vertices = vertices @ back[:3, :3].T + back[:3, 3]
    if len(vertices) and np.abs(vertices).max() > np.finfo(np.float32).max:
        raise MeshError("the result has coordinates too large for Blender: scale the mesh down")
    return vertices.astype(np.float32)


def _write_faces(mesh: bpy.types.Mesh, result: Simplified, source: MeshArrays) -> None:
    count = len(result.faces)
    mesh.loops.add(count * 3)
    mesh.polygons.add(count)
    write_attribute(mesh, ".corner_vert", "INT", "CORNER", np.ravel(result.faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, count * 3, 3, dtype=np.int32))
    material_index = source.material_index[result.face_map]
    if material_index.any():
        write_attribute(mesh, "material_index", "INT", "FACE", material_index)
    smooth = source.smooth[result.face_map]
    if not smooth.all():
        write_attribute(mesh, "sharp_face", "BOOLEAN", "FACE", ~smooth)
