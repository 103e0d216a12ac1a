# SPDX-License-Identifier: GPL-3.0-or-later
"""Collision hulls: convex meshes around an object or around each of its parts, with few corners."""

from collections.abc import Callable

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.adjacency import components
from ..core.mesh import MeshError, weld
from . import level_info
from .copies import copied
from .objects import SOURCE

MOST_CORNERS = 64  # what every engine takes
MOST_PARTS = 32


def add_hulls(stands: bpy.types.Object, finest: bpy.types.Object, base: str, name: Callable[[str, int], str],
              kind: str) -> list[bpy.types.Object]:
    """Add collision hulls where the levels are.

    Parameters
    ----------
    stands : bpy.types.Object
        Where they stand, and what moves them: the source, or a level.
    finest : bpy.types.Object
        What they are made around: the finest level.
    base : str
        The source's name.
    name : callable
        Names a hull from the source's name and a number from 1.
    kind : str
        "none", "one", or "parts": one for each connected part, unless there are too many of them.

    Returns
    -------
    list of bpy.types.Object

    Raises
    ------
    MeshError
        The kind has no meaning, or the mesh is flat.
    """
    if kind not in ("none", "one", "parts"):
        raise MeshError(f"unknown hulls {kind!r}: choose none, one or parts")
    if kind == "none":
        return []
    clouds = _clouds(finest.data, parts=kind == "parts" and name(base, 1) != name(base, 2))
    made = []
    for number, points in enumerate(clouds, start=1):
        hull = copied(stands, convex_hull(points, name(base, number)), modifiers_applied=True)
        hull.name = name(base, number)
        hull.display_type = "WIRE"
        hull[SOURCE], hull[level_info.MESH], hull[level_info.HULL] = base, finest.get(level_info.MESH, ""), number
        for collection in finest.users_collection:
            collection.objects.link(hull)
        made.append(hull)
    return made


def convex_hull(points: NDArray[np.float32], name: str) -> bpy.types.Mesh:
    """Make the convex hull of points, of at most `MOST_CORNERS` corners, all of them among the points.

    Parameters
    ----------
    points : ndarray, (n, 3) float32
    name : str
        Of the mesh.

    Raises
    ------
    MeshError
        The points lie in a plane.
    """
    made = bmesh.new()
    try:
        for point in _outermost(points):
            made.verts.new(point)
        found = bmesh.ops.convex_hull(made, input=made.verts, use_existing_faces=False)
        inner = dict.fromkeys([*found["geom_interior"], *found["geom_unused"]])
        bmesh.ops.delete(made, geom=[v for v in inner if isinstance(v, bmesh.types.BMVert)], context="VERTS")
        if len(made.faces) < 4:
            raise MeshError(f"'{name}' would be flat: a collision hull needs a body")
        bmesh.ops.recalc_face_normals(made, faces=made.faces)
        mesh = bpy.data.meshes.new(name)
        made.to_mesh(mesh)
    finally:
        made.free()
    return mesh


def _outermost(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Take the points that are farthest out in directions spread evenly, those along the axes among them."""
    points = np.unique(points, axis=0)
    if len(points) <= MOST_CORNERS:
        return points
    steps = np.arange(MOST_CORNERS - 6) + 0.5
    height = 1 - 2 * steps / len(steps)
    turn = np.pi * (1 + 5**0.5) * steps
    flat = np.sqrt(1 - height**2)
    around = np.stack((flat * np.cos(turn), flat * np.sin(turn), height), axis=1)
    directions = np.concatenate((np.eye(3), -np.eye(3), around))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    size = np.maximum(np.ptp(points, axis=0), 1e-30)
    return points[np.unique(np.argmax(((points - middle) / size) @ directions.T, axis=0))]


def _clouds(mesh: bpy.types.Mesh, *, parts: bool) -> list[NDArray[np.float32]]:
    """Give the points of the mesh, of each connected part if there are not too many."""
    points = np.zeros(len(mesh.vertices) * 3, np.float32)
    mesh.attributes["position"].data.foreach_get("vector", points)
    points = points.reshape(-1, 3)
    if not parts:
        return [points]
    edges = np.zeros(len(mesh.edges) * 2, np.int32)
    mesh.edges.foreach_get("vertices", edges)
    same = weld(points.astype(np.float64))
    part = components(len(points), *same.take(edges.reshape(-1, 2).T.astype(np.int64))).take(same)
    _, part = np.unique(part, return_inverse=True)
    clouds = [points[part == number] for number in range(min(int(part.max(initial=0)) + 1, MOST_PARTS + 1))]
    bodies = [cloud for cloud in clouds if _is_body(cloud)]
    return bodies if 0 < len(bodies) == len(clouds) <= MOST_PARTS else [points]


def _is_body(points: NDArray[np.float32]) -> bool:
    """Tell whether points span a volume."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    return bool(spread[-1] > 1e-5 * spread[0])
