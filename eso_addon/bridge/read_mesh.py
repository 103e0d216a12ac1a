# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh object as arrays: triangles as Blender makes them, in the size that the object has in the scene."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError
from .attributes import read_attribute
from .left_behind import names_left_behind


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """What is read of a mesh object; `materials` are references, everything else is free of Blender."""

    vertices: NDArray[np.float64]  # (n, 3), after `transform`
    triangles: NDArray[np.int64]  # (m, 3) vertex indices
    triangle_corners: NDArray[np.int64]  # (m, 3) corner indices
    triangle_polygon: NDArray[np.int64]  # (m,)
    material_index: NDArray[np.int32]  # (m,)
    smooth: NDArray[np.bool_]  # (m,)
    transform: NDArray[np.float64]  # (4, 4), object space to the space of `vertices`
    materials: tuple["bpy.types.Material | None", ...]
    left_behind: tuple[str, ...]  # data that simplified meshes lose, by name


def read_mesh(
    obj: bpy.types.Object,
    *,
    apply_modifiers: bool = True,
    depsgraph: bpy.types.Depsgraph | None = None,
    transform: NDArray[np.float64] | None = None,
) -> MeshArrays:
    """Read a mesh object, in Edit Mode too.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object; may be linked or hidden.
    apply_modifiers : bool
        Read the mesh as modifiers and shape keys leave it, not as it is stored.
    depsgraph : bpy.types.Depsgraph, optional
        Where modifiers are evaluated; the context's by default.
    transform : ndarray, (4, 4) float64, optional
        Put on the vertices. By default the scale part of the object's world matrix, so that lengths are the scene's.

    Returns
    -------
    MeshArrays

    Raises
    ------
    MeshError
        Not a mesh, a scale of zero, or modifiers that Blender does not evaluate.
    """
    if obj.type != "MESH":
        raise MeshError(f"'{obj.name}' is no mesh: convert it first (Object > Convert > Mesh)")
    if transform is None:
        transform = scale_transform(obj)
    if obj.data.is_editmode:
        obj.update_from_editmode()
    if apply_modifiers and is_changed_by_evaluation(obj):
        depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
        with _evaluated_mesh(obj, depsgraph) as mesh:
            return _arrays_of(obj, mesh, transform)
    with _stored_mesh(obj) as mesh:
        return _arrays_of(obj, mesh, transform)


def is_changed_by_evaluation(obj: bpy.types.Object) -> bool:
    """Tell whether modifiers or shape keys make the mesh another one than is stored."""
    return obj.data.shape_keys is not None or any(modifier.show_viewport for modifier in obj.modifiers)


def scale_transform(obj: bpy.types.Object) -> NDArray[np.float64]:
    """Give the scale part of an object's world matrix, mirrored or sheared by parents or not.

    Parameters
    ----------
    obj : bpy.types.Object

    Returns
    -------
    transform : ndarray, (4, 4) float64
        The stretch P of the polar decomposition R P; exactly the identity for an object that is not scaled.

    Raises
    ------
    MeshError
        A scale of zero, or one that is not finite.
    """
    linear = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    scales = np.zeros(3)
    if np.isfinite(linear).all():
        _, scales, axes = np.linalg.svd(linear)
    if scales.min() <= 1e-12 * max(scales.max(), 1e-30):
        raise MeshError(f"'{obj.name}' has a scale of zero: give it a size first (Object > Clear > Scale)")
    transform = np.eye(4)
    # Blender's matrices are float32: what is within their noise of no scale, is none.
    if np.abs(scales - 1).max() > 2e-6:
        transform[:3, :3] = axes.T @ (scales[:, None] * axes)
    return transform


@contextmanager
def _evaluated_mesh(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.Mesh]:
    evaluated = obj.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        raise MeshError(
            f"'{obj.name}' is disabled in the viewport, so its modifiers are not evaluated: "
            "enable it (monitor icon in the Outliner) or turn Apply Modifiers off"
        )
    mesh = evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    if mesh is None:
        raise MeshError(f"'{obj.name}' gives no mesh: check its modifiers")
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


@contextmanager
def _stored_mesh(obj: bpy.types.Object) -> Iterator[bpy.types.Mesh]:
    if not obj.data.is_editmode:
        yield obj.data
        return
    try:  # in Edit Mode the mesh itself shows no attributes, a copy of it does
        yield obj.to_mesh(preserve_all_data_layers=False)
    finally:
        obj.to_mesh_clear()


def _arrays_of(obj: bpy.types.Object, mesh: bpy.types.Mesh, transform: NDArray[np.float64]) -> MeshArrays:
    corners, polygon = _triangulated(mesh)
    corner_vertex = _read_or(mesh, ".corner_vert", len(mesh.loops), np.int32)
    positions = read_attribute(mesh, "position")
    vertices = np.zeros((0, 3)) if positions is None else positions.astype(np.float64)
    if not np.array_equal(transform, np.eye(4)):
        vertices = vertices @ transform[:3, :3].T + transform[:3, 3]
    material = _read_or(mesh, "material_index", len(mesh.polygons), np.int32)
    sharp = _read_or(mesh, "sharp_face", len(mesh.polygons), np.bool_)
    return MeshArrays(
        vertices=vertices,
        triangles=corner_vertex[corners].astype(np.int64).reshape(-1, 3),
        triangle_corners=corners.astype(np.int64).reshape(-1, 3),
        triangle_polygon=polygon.astype(np.int64),
        material_index=material[polygon],
        smooth=~sharp[polygon],
        transform=transform,
        materials=tuple(material and material.original for material in mesh.materials),
        left_behind=names_left_behind(obj, mesh, corner_vertex),
    )


def _triangulated(mesh: bpy.types.Mesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Give the corners of Blender's triangles, (m * 3,), and the polygon of each, (m,)."""
    if len(mesh.loops) == 3 * len(mesh.polygons):  # triangles already: what Blender would say, a good deal sooner
        return np.arange(len(mesh.loops), dtype=np.int32), np.arange(len(mesh.polygons), dtype=np.int32)
    mesh.calc_loop_triangles()
    corners = np.zeros(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    polygon = np.zeros(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    return corners, polygon


def _read_or(mesh: bpy.types.Mesh, name: str, count: int, dtype: type) -> NDArray:
    """Read an attribute that Blender leaves out where it is zero everywhere."""
    values = read_attribute(mesh, name)
    return np.zeros(count, dtype) if values is None else values
