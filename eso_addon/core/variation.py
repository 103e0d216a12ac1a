# SPDX-License-Identifier: GPL-3.0-or-later
"""How much the surface varies around each vertex: the weights of Equations 4 to 8 (Tseng and Lin)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .adjacency import one_rings, sorting_order
from .mesh import MeshError, check_mesh, morton_order
from .normals import face_area_vectors, lengths, vertex_normals
from .rings import Pairs, near_pairs

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

METHODS = ("qem", "cf", "so", "eso")


def vertex_weights(vertices: ArrayLike, faces: ArrayLike, *, method: str = "eso", rings: int = 3) -> Floats:
    """Weigh the vertices by how much the surface varies around them.

    Parameters
    ----------
    vertices : (n, 3) positions
    faces : (m, 3) triangles
    method : "eso" (Equation 8), "so" (Equation 7, one ring), "cf" (absolute value of Equation 4), "qem" (ones)
    rings : how many rings "eso" looks at

    Returns
    -------
    (n,) float64, per unit of length ("cf": per unit of area); zero where the surface is flat and at loose vertices

    Raises
    ------
    MeshError
        If the mesh is not valid, the method unknown or `rings` below one.
    """
    points, triangles = check_mesh(vertices, faces)
    if method not in METHODS:
        raise MeshError(f"unknown weights {method!r}: choose one of {', '.join(METHODS)}")
    if int(rings) != rings or rings < 1:
        raise MeshError(f"rings is {rings}: give a whole number of at least 1")
    if method == "qem" or len(triangles) == 0:
        return np.full(len(points), 1.0 if method == "qem" else 0.0)
    used = np.unique(triangles)  # loose vertices may hold anything
    order = used[morton_order(points[used])]
    rank = np.zeros(len(points), dtype=np.int64)
    rank[order] = np.arange(len(order))
    points, triangles = np.take(points, order, axis=0), np.take(rank, triangles)
    triangles = np.take(triangles, sorting_order(triangles[:, 0]), axis=0)  # neighbours together, for the cache
    weights = np.zeros(len(rank))
    if method == "cf":
        weights[order] = curvature(*angle_defects_and_areas(points, triangles))
    else:
        weights[order] = surface_variation(points, triangles, 1 if method == "so" else int(rings))
    return weights


def angle_defects_and_areas(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Return what a full turn has more than the angles around each vertex, and the area of its faces.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles

    Returns
    -------
    defects : (n,) float64 radians, 2 pi minus the sum of the angles (Equation 4)
    areas : (n,) float64, A(v) of Equation 4
    """
    corners = [np.take(vertices, faces[:, i], axis=0) for i in range(3)]
    doubled = 2.0 * lengths(face_area_vectors(vertices, faces))
    angles = np.empty((len(faces), 3))
    for i in range(3):
        u, v = corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]
        angles[:, i] = np.arctan2(doubled, np.einsum("ij,ij->i", u, v))
    count = len(vertices)
    sums = np.bincount(faces.ravel(), weights=angles.ravel(), minlength=count)
    areas = np.bincount(faces.ravel(), weights=np.repeat(0.5 * doubled, 3), minlength=count)
    return np.asarray(2.0 * np.pi - sums), np.asarray(areas, dtype=np.float64)


def curvature(defects: Floats, areas: Floats) -> Floats:
    """Return the absolute value of Equation 4, zero where there is no area.

    Works on vertices; with `edge_curvature_factor` for edges.
    """
    return np.divide(np.abs(defects), areas, out=np.zeros_like(areas), where=areas > 0.0)


def edge_curvature_factor(defects: Floats, areas: Floats, edges: Ints) -> Floats:
    """Return the curvature factor K of each edge (Equation 5), zero where there is no area.

    It is as false as the angle defects are at boundary and non-manifold vertices: a flat patch has a factor
    above zero along its boundary, which is the paper's case for the shape operator.

    Parameters
    ----------
    defects, areas : (n,) float64, of `angle_defects_and_areas`
    edges : (e, 2) int64 vertices

    Returns
    -------
    (e,) float64
    """
    one, other = edges[:, 0], edges[:, 1]
    area = np.take(areas, one) + np.take(areas, other)
    turn = np.abs(np.take(defects, one)) + np.abs(np.take(defects, other))
    return np.divide(turn, area, out=np.zeros_like(area), where=area > 0.0)


def surface_variation(vertices: Floats, faces: Ints, rings: int, area_vectors: Floats | None = None) -> Floats:
    """Return the extended shape operator S of each vertex (Equation 8; with one ring Equation 7).

    S is the sum of the differences of unit normals between a vertex and all vertices within so many rings,
    divided by the sum of their distances. Exact in any order of the vertices, quick in a spatial one.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles, with the winding of neighbours agreeing
    rings : number of rings, 1 or more
    area_vectors : (m, 3) float64, what `face_area_vectors` gives, where it is at hand

    Returns
    -------
    (n,) float64, per unit of length
    """
    count = len(vertices)
    offsets, neighbours = one_rings(faces, count)
    positions, normals = _rows_of_four(vertices), _rows_of_four(vertex_normals(vertices, faces, area_vectors))
    turns, ways = np.zeros(count), np.zeros(count)
    for pairs in near_pairs(offsets, neighbours, rings):
        _add_distances(turns, normals, pairs)
        _add_distances(ways, positions, pairs)
    return np.divide(turns, ways, out=np.zeros(count), where=ways > 0.0)


def _rows_of_four(vectors: Floats) -> Floats:
    """Pad rows of three: numpy gathers rows of 32 bytes as fast as single numbers."""
    rows = np.zeros((len(vectors), 4))
    rows[:, :3] = vectors
    return rows


def _add_distances(sums: Floats, rows: Floats, pairs: Pairs) -> None:
    """Add the distance between the rows of each pair to the sums of both its ends."""
    local = np.take(rows, pairs.vertices, axis=0)
    difference = np.take(local, pairs.others, axis=0)
    difference -= np.repeat(np.take(local, pairs.owners, axis=0), pairs.counts, axis=0)
    difference *= difference
    # adding the halves of rows as complex numbers is several times as quick as a sum along the rows
    halves = difference.view(np.complex128)
    folded = halves[:, 0] + halves[:, 1]
    distance = folded.real + folded.imag
    np.sqrt(distance, out=distance)
    local_sums = np.bincount(pairs.others, distance, len(local))
    local_sums[pairs.owners] += np.add.reduceat(distance, np.cumsum(pairs.counts) - pairs.counts)
    np.add.at(sums, pairs.vertices, local_sums)
