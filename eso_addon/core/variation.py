# SPDX-License-Identifier: GPL-3.0-or-later
"""How much the surface varies around each vertex: the weights of Equations 4 to 8 (Tseng and Lin)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .adjacency import one_rings
from .mesh import MeshError, check_mesh, morton_order
from .normals import face_area_vectors, lengths, vertex_normals

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bits = NDArray[np.uint64]

METHODS = ("qem", "cf", "so", "eso")
# vertices a block: their bits, indices and pairs then stay in the processor's second cache
BLOCK = 512


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
    return 2.0 * np.pi - sums, areas


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


def surface_variation(vertices: Floats, faces: Ints, rings: int) -> Floats:
    """Return the extended shape operator S of each vertex (Equation 8; with one ring Equation 7).

    S is the sum of the differences of unit normals between a vertex and all vertices within so many rings,
    divided by the sum of their distances. Exact in any order of the vertices, quick in a spatial one.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles, with the winding of neighbours agreeing
    rings : number of rings, 1 or more

    Returns
    -------
    (n,) float64, per unit of length
    """
    count = len(vertices)
    offsets, neighbours = one_rings(faces, count)
    coordinates = np.ascontiguousarray(np.hstack((vertices, vertex_normals(vertices, faces))).T)
    graph = _Graph(offsets, neighbours, np.full(count, -1), np.full(count, -1))
    turns, ways = np.zeros(count), np.zeros(count)
    for start in range(0, count, BLOCK):
        columns, one, other = _near_pairs(graph, start, min(start + BLOCK, count), rings)
        local = np.take(coordinates, columns, axis=1)
        ways[columns] += _both_ends(_distances(local[:3], one, other), one, other, len(columns))
        turns[columns] += _both_ends(_distances(local[3:], one, other), one, other, len(columns))
    return np.divide(turns, ways, out=np.zeros(count), where=ways > 0.0)


def _distances(coordinates: Floats, one: Ints, other: Ints) -> Floats:
    """Return the distance between the two ends of each pair; one row of coordinates at a time is quickest."""
    total = np.zeros(len(one))
    for row in coordinates:
        difference = np.take(row, one)
        difference -= np.take(row, other)
        difference *= difference
        total += difference
    return np.asarray(np.sqrt(total, out=total))


def _both_ends(values: Floats, one: Ints, other: Ints, count: int) -> Floats:
    """Add the value of each pair to both of its ends."""
    return np.bincount(one, values, count) + np.bincount(other, values, count)


class _Graph(NamedTuple):
    """The one-rings (CSR), and two tables for the numbers of vertices within a block (-1 outside it)."""

    offsets: Ints
    neighbours: Ints
    row: Ints
    column: Ints


def _near_pairs(graph: _Graph, start: int, end: int, rings: int) -> tuple[Ints, Ints, Ints]:
    """Find the pairs of vertices within so many rings whose lower end lies in a block, each once.

    Sets of vertices are rows of bits: the set within k + 1 rings of a vertex is the union of its neighbours'
    sets within k, so rings grow by gathering rows and need no sorting.

    Returns
    -------
    columns : (c,) int64 vertices that the pairs are made of, those of the block first
    one, other : (p,) int64 positions in `columns`, `one` always in the block
    """
    size = end - start
    sizes, vertices, counts, neighbours = _neighbourhood(graph, start, end, rings)
    columns = vertices[vertices >= start]  # the pairs with a lower vertex belong to its block
    graph.column[columns] = np.arange(len(columns))
    words = (len(columns) + 63) // 64
    reach = _one_ring_bits(graph, vertices[: sizes[-2]], counts, neighbours, words)
    places = np.take(graph.row, neighbours)
    starts = np.cumsum(counts) - counts
    for within in sizes[-3::-1]:
        reach = _union(reach, places, starts[:within], counts[:within])
    reach = reach[:size]
    own = (size + 63) // 64
    reach[:, :own] &= _upper_triangle(size)
    graph.row[vertices] = -1
    graph.column[columns] = -1
    position = _set_bits(reach)
    one = position // (words * 64)
    return columns, one, position - one * (words * 64)


def _neighbourhood(graph: _Graph, start: int, end: int, rings: int) -> tuple[list[int], Ints, Ints, Ints]:
    """Find the vertices around a block ring by ring, and set their numbers in `graph.row`.

    Returns
    -------
    sizes : how many vertices the block has, it and its first ring, ...
    vertices : (k,) int64, the block, its first ring, ...
    counts, neighbours : one-rings of all but the last ring
    """
    offsets = graph.offsets
    near = graph.neighbours[offsets[start] : offsets[end]]
    vertices, counts, neighbours = [np.arange(start, end)], [np.diff(offsets[start : end + 1])], [near]
    graph.row[start:end] = np.arange(end - start)
    sizes = [end - start]
    for ring in range(rings):
        front = np.sort(near[np.take(graph.row, near) < 0])
        front = front[np.diff(front, prepend=-1) > 0]
        graph.row[front] = np.arange(sizes[-1], sizes[-1] + len(front))
        sizes.append(sizes[-1] + len(front))
        vertices.append(front)
        if ring < rings - 1:
            first = np.take(offsets, front)
            count = np.take(offsets, front + 1) - first
            shift = np.repeat(first - np.cumsum(count) + count, count)
            near = np.take(graph.neighbours, np.arange(len(shift)) + shift)
            counts.append(count)
            neighbours.append(near)
    return sizes, np.concatenate(vertices), np.concatenate(counts), np.concatenate(neighbours)


def _one_ring_bits(graph: _Graph, vertices: Ints, counts: Ints, neighbours: Ints, words: int) -> Bits:
    """Return a row of bits for each vertex: itself and its neighbours, and an empty row at the end."""
    rows = np.concatenate((np.repeat(np.arange(len(counts)), counts), np.arange(len(counts))))
    columns = np.take(graph.column, np.concatenate((neighbours, vertices)))
    inside = columns >= 0
    rows, columns = rows[inside], columns[inside]
    bits = np.zeros((len(counts) + 1, words), dtype="<u8")
    # each bit comes once, so adding sets it, and add.at is quicker than bitwise_or.at
    np.add.at(bits.reshape(-1), rows * words + (columns >> 6), np.left_shift(np.uint64(1), (columns & 63).view("u8")))
    return bits


def _union(sets: Bits, places: Ints, starts: Ints, counts: Ints) -> Bits:
    """Unite the sets at `places[starts[i] : starts[i] + counts[i]]` for each i, and add an empty row."""
    union = np.zeros((len(starts) + 1, sets.shape[1]), dtype=sets.dtype)
    rows = np.flatnonzero(counts > 0)
    nth = 0
    while len(rows):
        which = rows if len(rows) < len(starts) else slice(0, len(starts))
        union[which] |= np.take(sets, np.take(places, starts[rows] + nth), axis=0)
        nth += 1
        rows = rows[counts[rows] > nth]
    return union


def _upper_triangle(size: int) -> Bits:
    """Return rows of bits in which row i holds what comes after i."""
    square = np.ones((size, (size + 63) // 64 * 64), dtype=np.uint8)
    return np.packbits(np.triu(square, 1), axis=1, bitorder="little").view("<u8")


def _set_bits(sets: Bits) -> Ints:
    """Return the positions of all bits that are set, counted through all rows."""
    octets = sets.view(np.uint8).reshape(-1)
    filled = np.flatnonzero(octets != 0)
    found = np.flatnonzero(np.unpackbits(np.take(octets, filled), bitorder="little").view(np.bool_))
    return (np.take(filled, found >> 3) << 3) + (found & 7)
