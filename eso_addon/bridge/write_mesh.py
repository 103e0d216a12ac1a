# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays as a new Blender mesh: valid, with all that the source carries, back in object space."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError
from .active_layers import write_active
from .attributes import read_attribute, write_attribute
from .layers import Layer, write_layer
from .polygons import Polygons, polygons_again, triangles_alone
from .read_mesh import GROUPS, KEYS, NORMALS, MeshArrays
from .shape_keys import write_keys
from .vertex_groups import limited, write_groups


class Simplified(Protocol):
    """What of the engine's result is written; `attributes`, `edges` and `vertex_map` too where it has them."""

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Positions, (k, 3)."""

    @property
    def faces(self) -> NDArray[np.int32]:
        """Vertex indices, (m, 3)."""

    @property
    def face_map(self) -> NDArray[np.int32]:
        """The source's triangle that each face comes from, (m,)."""


def write_mesh(result: Simplified, source: MeshArrays, name: str, *, join_quads: bool = False, keep_loose: bool = True,
               influences: int | None = None) -> bpy.types.Mesh:
    """Build a mesh datablock from a simplified mesh.

    Parameters
    ----------
    result : Simplified
        In the space of ``source.vertices``.
    source : MeshArrays
        What was simplified: its transform is undone, what it carries is handed on.
    name : str
        Of the new datablock.
    join_quads : bool
        Join the triangles of quads again where they have changed; where they have not, polygons are what they were.
    keep_loose : bool
        Keep points and edges without faces.
    influences : int, optional
        Bones that may move a vertex, 0 for any number; as many as in the source by default.

    Returns
    -------
    bpy.types.Mesh

    Raises
    ------
    MeshError
        A position that single precision cannot hold.
    """
    positions = _in_object_space(result.vertices, source.transform)
    loose = _loose(result, source) if keep_loose else _Loose.none()
    mesh = _empty_like(source, name)
    if len(positions) + len(loose.vertices):
        mesh.vertices.add(len(positions) + len(loose.vertices))
        stray = _in_object_space(source.vertices[loose.vertices], source.transform)
        write_attribute(mesh, "position", "FLOAT_VECTOR", "POINT", np.concatenate((positions, stray)))
    if len(loose.edges):
        mesh.edges.add(len(loose.edges))
        write_attribute(mesh, ".edge_verts", "INT32_2D", "EDGE", loose.edges)
    polygons = _polygons(result, source, join=join_quads)
    if len(result.faces):
        _write_faces(mesh, result, source, polygons)
    mesh.update(calc_edges=True)
    _write_layers(mesh, result, source, polygons, loose)
    _write_owned(mesh, result, source, polygons, loose, influences)
    if _has_twins(result.faces):
        mesh.validate()  # drops faces with the same three vertices: Blender has no place for them
    return mesh


class _Loose:
    """What belongs to no face: the source's vertices that are added, and edges in the new mesh's numbers."""

    def __init__(self, vertices: NDArray[np.int64], edges: NDArray[np.int32], source: NDArray[np.int64]) -> None:
        self.vertices, self.edges, self.source = vertices, edges, source

    @classmethod
    def none(cls) -> "_Loose":
        nothing = np.zeros(0, np.int64)
        return cls(nothing, np.zeros((0, 2), np.int32), nothing)


def _loose(result: Simplified, source: MeshArrays) -> _Loose:
    used = np.zeros(len(source.vertices), bool)
    used[source.triangles] = True
    vertices = np.flatnonzero(~used)
    if not len(vertices) and not len(source.wires):
        return _Loose.none()
    number = np.full(len(used), -1)
    vertex_map = getattr(result, "vertex_map", None)
    if vertex_map is not None:
        number[:] = vertex_map
    number[vertices] = len(result.vertices) + np.arange(len(vertices))
    edges = number.take(source.edges.take(source.wires, axis=0))
    there = np.flatnonzero((edges >= 0).all(axis=1) & (edges[:, 0] != edges[:, 1]))
    return _Loose(vertices, edges.take(there, axis=0).astype(np.int32), source.wires.take(there))


def _empty_like(source: MeshArrays, name: str) -> bpy.types.Mesh:
    """Make a mesh without elements that has the source's materials, properties and settings."""
    mesh = source.template.copy()
    mesh.name = name
    with _object_of(mesh) as obj:
        if mesh.shape_keys is not None:
            obj.shape_key_clear()
        obj.vertex_groups.clear()
    mesh.clear_geometry()
    mesh.materials.clear()
    for material in source.materials:
        mesh.materials.append(material)
    return mesh


@contextmanager
def _object_of(mesh: bpy.types.Mesh) -> Iterator[bpy.types.Object]:
    """Give an object that shows a mesh: groups and shape keys can only be made through one."""
    obj = bpy.data.objects.new(mesh.name, mesh)
    try:
        yield obj
    finally:
        bpy.data.objects.remove(obj)


def _polygons(result: Simplified, source: MeshArrays, *, join: bool) -> Polygons:
    if source.polygon_sizes.max(initial=3) <= 3:
        return triangles_alone(source.triangle_polygon[result.face_map])
    faces = np.asarray(result.faces, np.int64).reshape(-1, 3)
    before = source.vertices[source.triangles[result.face_map]]
    moved = (result.vertices[faces] != before).any(axis=(1, 2))
    return polygons_again(faces, moved, source.triangle_corners[result.face_map],
                          source.triangle_polygon[result.face_map], source.polygon_sizes, join=join)


def _has_twins(faces: NDArray[np.int32]) -> bool:
    """Tell whether faces share all three vertices; looking is ten times as quick as Blender's validation."""
    a, b, c = faces.T.astype(np.uint64)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    keys = np.sort((low * np.uint64(0x9E3779B97F4A7C15) + middle) * np.uint64(0xC2B2AE3D27D4EB4F) + high)
    return bool((keys[1:] == keys[:-1]).any())  # or one in a billion others


def _in_object_space(vertices: NDArray[np.float64], transform: NDArray[np.float64]) -> NDArray[np.float32]:
    if not np.array_equal(transform, np.eye(4)):
        back = np.linalg.inv(transform)
        vertices = vertices @ back[:3, :3].T + back[:3, 3]
    if len(vertices) and np.abs(vertices).max() > np.finfo(np.float32).max:
        raise MeshError("the result has coordinates too large for Blender: scale the mesh down")
    return vertices.astype(np.float32)


def _write_faces(mesh: bpy.types.Mesh, result: Simplified, source: MeshArrays, polygons: Polygons) -> None:
    mesh.loops.add(len(polygons.slots))
    mesh.polygons.add(len(polygons.starts))
    corners = np.ravel(result.faces).take(polygons.slots)
    write_attribute(mesh, ".corner_vert", "INT", "CORNER", corners)
    mesh.polygons.foreach_set("loop_start", polygons.starts.astype(np.int32))
    triangle = np.asarray(result.face_map).take(polygons.slots.take(polygons.starts) // 3)
    if source.material_index[triangle].any():
        write_attribute(mesh, "material_index", "INT", "FACE", source.material_index[triangle])
    if not source.smooth[triangle].all():
        write_attribute(mesh, "sharp_face", "BOOLEAN", "FACE", ~source.smooth[triangle])


def _write_layers(mesh: bpy.types.Mesh, result: Simplified, source: MeshArrays, polygons: Polygons,
                  loose: _Loose) -> None:
    """Write the attributes of all domains."""
    carried = getattr(result, "attributes", {})
    for layer in source.layers:
        if layer.name in ("material_index", "sharp_face"):
            continue  # written with the faces
        if layer.domain == "FACE":
            values = layer.values[polygons.source]
        elif layer.name not in carried:
            continue
        elif layer.domain == "CORNER":
            values = carried[layer.name].reshape(-1, *layer.values.shape[1:])[polygons.slots]
        elif layer.domain == "POINT":
            values = np.concatenate((carried[layer.name], layer.values[loose.vertices]))
        else:
            values = _at_edges(mesh, layer, carried[layer.name], result.edges, loose)  # type: ignore[attr-defined]
        write_layer(mesh, layer, values)
    write_active(mesh, source.active or {})


def _at_edges(mesh: bpy.types.Mesh, layer: Layer, values: NDArray, edges: NDArray[np.int32],
              loose: _Loose) -> NDArray:
    """Put values of the result's edges and of loose edges in the order of the mesh's edges."""
    count = max(len(mesh.vertices), 1)
    known = np.concatenate((edges.reshape(-1, 2), loose.edges)).astype(np.int64)
    rows = np.concatenate((values, layer.values[loose.source]))
    keys = known.min(axis=1, initial=count) * count + known.max(axis=1, initial=0)
    own = read_attribute(mesh, ".edge_verts")
    if own is None or len(keys) == 0:
        return np.zeros((len(mesh.edges), *layer.values.shape[1:]), layer.values.dtype)
    own = own.astype(np.int64)
    wanted = own.min(axis=1) * count + own.max(axis=1)
    order = np.argsort(keys, kind="stable")
    place = np.searchsorted(keys, wanted, sorter=order).clip(max=len(keys) - 1)
    found = order[place]
    out = rows[found]
    out[keys[found] != wanted] = "" if layer.values.dtype.kind == "O" else 0
    return out


def _write_owned(mesh: bpy.types.Mesh, result: Simplified, source: MeshArrays, polygons: Polygons, loose: _Loose,
                 influences: int | None) -> None:
    """Write custom normals, vertex groups and shape keys."""
    carried = getattr(result, "attributes", {})
    if source.normals is not None and NORMALS in carried and len(mesh.loops):
        _write_normals(mesh, carried[NORMALS].reshape(-1, 3)[polygons.slots], free=source.free_normals)
    with _object_of(mesh) as obj:
        if source.groups is not None and GROUPS in carried:
            weights = np.concatenate((carried[GROUPS], source.groups.weights[loose.vertices]))
            most = source.groups.influences if influences is None else influences
            write_groups(obj, source.groups, limited(weights, source.groups.deforms, most))
        if source.keys is not None and KEYS in carried:
            offsets = np.concatenate((carried[KEYS], source.keys.offsets[:, loose.vertices].transpose(1, 0, 2)))
            write_keys(obj, source.keys, offsets.transpose(1, 0, 2))


def _write_normals(mesh: bpy.types.Mesh, normals: NDArray, *, free: bool) -> None:
    """Write custom normals, (corners, 3): free ones as they are, others in Blender's own way."""
    if free:
        write_attribute(mesh, "custom_normal", "FLOAT_VECTOR", "CORNER", normals)
    else:
        mesh.normals_split_custom_set(normals)
