# SPDX-License-Identifier: GPL-3.0-or-later
"""Who meets whom in a triangle mesh: edges, rings, stars, boundary, non-manifold places, components."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _sorted_sides(faces: Ints, vertex_count: int) -> Ints:
    """Return the undirected sides of all faces as sorted keys `low * vertex_count + high`."""
    keys = np.empty((3, len(faces)), dtype=np.int64)
    for i in range(3):
        a, b = faces[:, i], faces[:, (i + 1) % 3]
        np.add(np.minimum(a, b) * vertex_count, np.maximum(a, b), out=keys[i])
    flat = keys.ravel()
    flat.sort()
    return flat


def _run_starts(sorted_keys: Ints) -> Ints:
    """Return where each run of equal values begins."""
    first = np.ones(len(sorted_keys), dtype=bool)
    np.not_equal(sorted_keys[1:], sorted_keys[:-1], out=first[1:])
    return np.flatnonzero(first)


def _offsets(counts: Ints) -> Ints:
    """Return the CSR offsets of rows with these counts."""
    offsets = np.zeros(len(counts) + 1, dtype=np.int64)
    np.cumsum(counts, out=offsets[1:])
    return offsets


def unique_edges(faces: Ints, vertex_count: int) -> tuple[Ints, Ints]:
    """Return every undirected edge once, and how many faces have it.

    Parameters
    ----------
    faces : (m, 3) int64 triangles
    vertex_count : number of vertices

    Returns
    -------
    edges : (e, 2) int64, lower vertex first, in ascending order
    face_counts : (e,) int64: 1 at a boundary, 2 inside a manifold, more at a non-manifold edge
    """
    keys = _sorted_sides(faces, vertex_count)
    starts = _run_starts(keys)
    counts = np.diff(starts, append=len(keys))
    edges = np.empty((len(starts), 2), dtype=np.int64)
    keys = np.take(keys, starts)
    np.floor_divide(keys, max(vertex_count, 1), out=edges[:, 0])
    np.subtract(keys, edges[:, 0] * vertex_count, out=edges[:, 1])
    proper = edges[:, 0] != edges[:, 1]
    return (edges, counts) if proper.all() else (edges[proper], counts[proper])


def boundary_edges(faces: Ints, vertex_count: int) -> Ints:
    """Return the edges of one face only: (b, 2) int64, lower vertex first."""
    edges, counts = unique_edges(faces, vertex_count)
    return edges[counts == 1]


def boundary_vertices(faces: Ints, vertex_count: int) -> Bools:
    """Return whether each vertex ends a boundary edge: (n,) bool."""
    return _marked(boundary_edges(faces, vertex_count), vertex_count)


def nonmanifold_edges(faces: Ints, vertex_count: int) -> Ints:
    """Return the edges of more than two faces: (k, 2) int64, lower vertex first."""
    edges, counts = unique_edges(faces, vertex_count)
    return edges[counts > 2]


def nonmanifold_vertices(faces: Ints, vertex_count: int) -> Bools:
    """Return whether the star of each vertex is anything but one fan of faces, open or closed: (n,) bool.

    So it is true at the ends of an edge of more than two faces, and where fans touch in a point only.
    """
    fans = corner_fans(faces, vertex_count).ravel()
    fan_vertex = np.zeros(int(fans.max(initial=-1)) + 1, dtype=np.int64)
    fan_vertex[fans] = faces.ravel()
    pinched = np.bincount(fan_vertex, minlength=vertex_count) > 1
    return pinched | _marked(nonmanifold_edges(faces, vertex_count), vertex_count)


def _marked(ids: Ints, count: int) -> Bools:
    marks = np.zeros(count, dtype=bool)
    marks[ids.ravel()] = True
    return marks


def corner_fans(faces: Ints, vertex_count: int) -> Ints:
    """Return the fan of each corner: corners at one vertex whose faces hang together by edges at that vertex.

    Returns
    -------
    (m, 3) int64 numbers from 0 on; a vertex with two of them is pinched
    """
    sides = np.arange(3 * len(faces))
    # the corner where a side begins, and the corner where it ends
    begins, ends = sides, sides - 2 * (sides % 3 == 2) + (sides % 3 != 2)
    corners = faces.ravel()
    from_vertex, to_vertex = corners, np.take(corners, ends)
    rising = from_vertex < to_vertex
    low, high = np.where(rising, begins, ends), np.where(rising, ends, begins)
    keys = np.minimum(from_vertex, to_vertex) * vertex_count + np.maximum(from_vertex, to_vertex)
    order = sorting_order(keys)
    keys = np.take(keys, order)
    first = np.flatnonzero(keys[1:] == keys[:-1])
    a, b = np.take(order, first), np.take(order, first + 1)
    ones = np.concatenate((np.take(low, a), np.take(high, a)))
    others = np.concatenate((np.take(low, b), np.take(high, b)))
    return components(len(corners), ones, others).reshape(faces.shape)


def sorting_order(keys: Ints) -> Ints:
    """Return the stable order that sorts keys that are not negative: (k,) int64.

    The index is packed under the key where both fit into 63 bits, because sorting values is several times
    as fast as sorting indices.
    """
    index_bits = max(len(keys) - 1, 1).bit_length()
    if int(keys.max(initial=0)).bit_length() + index_bits > 63:
        return np.argsort(keys, kind="stable")
    packed = (keys << index_bits) | np.arange(len(keys))
    packed.sort()
    packed &= (1 << index_bits) - 1
    return packed


def one_rings(faces: Ints, vertex_count: int) -> tuple[Ints, Ints]:
    """Return the vertices that share an edge with each vertex, as CSR.

    Parameters
    ----------
    faces : (m, 3) int64 triangles
    vertex_count : number of vertices

    Returns
    -------
    offsets : (n + 1,) int64
    neighbours : (2 e,) int64; those of vertex v are `neighbours[offsets[v]:offsets[v + 1]]`, ascending
    """
    edges, _ = unique_edges(faces, vertex_count)
    return rings_of_edges(edges, vertex_count)


def rings_of_edges(edges: Ints, vertex_count: int) -> tuple[Ints, Ints]:
    """Return what `one_rings` does from the edges that `unique_edges` gives, in their order."""
    low, high = np.ascontiguousarray(edges.T)
    lower_keys = high * vertex_count
    lower_keys += low
    lower_keys.sort()
    lower_counts = np.bincount(high, minlength=vertex_count)
    higher_counts = np.bincount(low, minlength=vertex_count)
    offsets = _offsets(lower_counts + higher_counts)
    neighbours = np.empty(2 * len(edges), dtype=np.int64)
    # a vertex's lower neighbours come first; both kinds are sorted already, so that each knows its place
    place = np.arange(len(edges))
    lower_keys -= np.repeat(np.arange(vertex_count) * vertex_count, lower_counts)
    neighbours[place + np.repeat(np.cumsum(higher_counts) - higher_counts, lower_counts)] = lower_keys
    neighbours[place + np.repeat(np.cumsum(lower_counts), higher_counts)] = high
    return offsets, neighbours


def face_neighbors(faces: Ints, vertex_count: int) -> Ints:
    """Return the face across each side of each face: (3, m) int64, side i from corner i to the next one.

    At a boundary it is the face itself, at an edge of several faces one of the others.
    """
    begin, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    keys = np.minimum(begin, end) * vertex_count + np.maximum(begin, end)
    order = sorting_order(keys)
    keys = keys.take(order)
    same = keys[1:] == keys[:-1]
    before, after = order[:-1][same], order[1:][same]
    neighbors = np.tile(np.arange(len(faces)), 3)
    neighbors[before], neighbors[after] = after % len(faces), before % len(faces)
    return neighbors.reshape(3, -1)


def stars(faces: Ints, vertex_count: int) -> tuple[Ints, Ints]:
    """Return the faces around each vertex, as CSR.

    Returns
    -------
    offsets : (n + 1,) int64
    star_faces : (3 m,) int64; those of vertex v are `star_faces[offsets[v]:offsets[v + 1]]`, ascending
    """
    face_count = len(faces)
    keys = (faces * face_count + np.arange(face_count)[:, None]).ravel()
    keys.sort()
    counts = np.bincount(faces.ravel(), minlength=vertex_count)
    return _offsets(counts), keys - np.repeat(np.arange(vertex_count) * face_count, counts)


def components(count: int, ones: Ints, others: Ints) -> Ints:
    """Return the number of the connected component of each node of a graph.

    Parameters
    ----------
    count : number of nodes
    ones, others : (k,) int64, the two ends of each link

    Returns
    -------
    (count,) int64 from 0 on, numbered by the first node of each component
    """
    root = np.arange(count)
    while True:
        ones, others = np.take(root, ones), np.take(root, others)
        apart = ones != others
        if not apart.any():
            break
        ones, others = ones[apart], others[apart]
        # each root takes the least root that it is linked to, then all paths are cut short
        np.minimum.at(root, np.maximum(ones, others), np.minimum(ones, others))
        while True:
            above = np.take(root, root)
            if np.array_equal(above, root):
                break
            root = above
    is_root = root == np.arange(count)
    return np.take(np.cumsum(is_root) - 1, root)


def vertex_components(faces: Ints, vertex_count: int) -> Ints:
    """Return the connected component of each vertex: (n,) int64 from 0 on; a loose vertex is one of its own."""
    ones = np.concatenate((faces[:, 0], faces[:, 1]))
    others = np.concatenate((faces[:, 1], faces[:, 2]))
    return components(vertex_count, ones, others)


def part_diagonals(vertices: Floats, faces: Ints, part: Ints) -> Floats:
    """Return the diagonal of the bounding box of each part of a mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    part : (m,) int64, the part of each face, from 0

    Returns
    -------
    (p,) float64
    """
    count = int(part.max(initial=-1)) + 1
    square = np.zeros(count)
    for axis in range(3):
        values = vertices[:, axis].take(faces)
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, part, values.min(axis=1))
        np.maximum.at(high, part, values.max(axis=1))
        # numbers that no face has stay without size
        square += np.square(np.maximum(high - low, 0))
    return np.sqrt(square)
