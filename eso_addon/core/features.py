# SPDX-License-Identifier: GPL-3.0-or-later
"""Features of a mesh (Chen and Nishita, section 3): sharp edges, the SOD and ESOD operators, base edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .adjacency import sorting_order
from .mesh import Bools, Floats, Ints, MeshError
from .normals import face_area_vectors, face_normals, lengths

_MIXER = np.uint64(0x9E3779B97F4A7C15)


def sharp_edges(vertices: Floats, faces: Ints, *, face_values: Sequence[ArrayLike] = (),
                corner_values: Sequence[ArrayLike] = (), marked: ArrayLike | None = None,
                angle: float | None = None) -> Ints:
    """Find the sharp edges (section 3.2): boundaries, and where attributes differ.

    An edge that does not have exactly two faces is sharp, and so is one whose two faces differ in a face's value, or
    in a corner's value at either of its ends.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    face_values : sequence of (m,) or (m, k) arrays
        Discrete attributes of faces, such as the material.
    corner_values : sequence of (m, 3) or (m, 3, k) arrays
        Attributes of corners, such as UV or normals.
    marked : array_like, (s, 2) ints, optional
        Edges that are sharp because the user says so, as pairs of vertices. Pairs that are no edge are left out.
    angle : float, optional
        Edges between faces whose normals are further apart than so many degrees.

    Returns
    -------
    ndarray, (e, 2) int64
        Lower vertex first, in ascending order.

    Raises
    ------
    MeshError
        An attribute's shape does not fit the mesh.
    """
    count = len(vertices)
    keys, inner = side_pairs(faces.T, count)
    one, other = inner
    edge = keys.take(one)
    sharp = np.zeros(len(edge), bool)
    width = len(faces)
    one_face, other_face = one % width, other % width
    for values in face_values:
        rows = _rows(values, faces.shape[:1], "face")
        sharp |= (rows.take(one_face, axis=0) != rows.take(other_face, axis=0)).any(axis=1)
    low_corners, high_corners = _corners_of_ends(faces, one), _corners_of_ends(faces, other)
    for values in corner_values:
        rows = _rows(values, faces.shape, "corner")
        for corner, opposite in zip(low_corners, high_corners, strict=True):
            sharp |= (rows.take(corner, axis=0) != rows.take(opposite, axis=0)).any(axis=1)
    if angle is not None:
        sharp |= sod_weights(vertices, faces, one_face, other_face) < np.cos(np.radians(angle))
    alone = np.ones(len(keys), bool)
    alone[one] = alone[other] = False
    if marked is not None:
        ends = np.sort(np.asarray(marked, np.int64).reshape(-1, 2), axis=1)
        sharp |= np.isin(edge, ends[:, 0] * count + ends[:, 1])
    found = np.unique(np.concatenate((edge[sharp], keys[alone])))
    return np.stack(np.divmod(found, max(count, 1)), axis=1)


def sod_weights(vertices: Floats, faces: Ints, one: Ints, other: Ints) -> Floats:
    """Return the SOD weight of edges (section 3.3): the product of the unit normals of their two faces, (e,) float64.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    one, other : ndarray, (e,) int64
        The two faces of each edge.
    """
    normals = face_normals(vertices, faces)
    return np.asarray(np.einsum("ij,ij->i", normals.take(one, axis=0), normals.take(other, axis=0)))


def esod_weights(vertices: Floats, faces: Ints, one: Ints, other: Ints) -> Floats:
    """Return the ESOD weight of edges (section 3.3): the product of the mean normals at the two vertices opposite.

    The virtual edge {i, j} of an edge {k, l} has k and l opposite, so its weight is that of the edge's own ends.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    one, other : ndarray, (e,) int64
        The two vertices opposite each edge.

    Returns
    -------
    ndarray, (e,) float64
    """
    normals = mean_normals(vertices, faces)
    return np.asarray(np.einsum("ij,ij->i", normals.take(one, axis=0), normals.take(other, axis=0)))


def mean_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return the mean of the unit normals of each vertex's faces weighted by area, NOT of unit length: (n, 3) float64.

    Its length tells how flat the star is: one where it is plane, less where it is bent (section 3.3).
    """
    vectors = face_area_vectors(vertices, faces)
    areas = lengths(vectors)
    corners = np.ascontiguousarray(faces.T)
    sums = [sum(np.bincount(corner, values, len(vertices)) for corner in corners) for values in (*vectors.T, areas)]
    return np.stack(sums[:3], axis=1) / np.maximum(sums[3], 1e-300)[:, None]


def base_edges(vertices: Floats, faces: Ints, epsilon: float) -> Ints:
    """Find the base edges (section 3.3): those whose virtual edge is a feature, (e, 2) int64, lower vertex first.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    epsilon : float
        A virtual edge of lesser weight is a feature; from -1 to 1.
    """
    normals = mean_normals(vertices, faces)
    a, b = faces.T.ravel(), np.roll(faces.T, -1, axis=0).ravel()
    weight = np.einsum("ij,ij->i", normals.take(a, axis=0), normals.take(b, axis=0))
    return with_virtual_edge(faces.T, len(vertices), np.flatnonzero(weight < epsilon))


def with_virtual_edge(faces: Ints, count: int, slots: Ints) -> Ints:
    """Return the edges among some sides that have a virtual edge: two faces whose far corners no edge joins.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    count : int
        Number of vertices.
    slots : ndarray, (s,) int64
        Sides as `corner * m + face`, both of an edge where it has two.

    Returns
    -------
    ndarray, (e, 2) int64
        Lower vertex first, in ascending order.
    """
    keys, (one, other) = side_pairs(faces, count, slots)
    width, corners = faces.shape[1], faces.ravel()
    far = [corners.take((slots.take(side) + 2 * width) % len(corners)) for side in (one, other)]
    free = ~_joined(faces, count, far[0], far[1])
    return np.stack(np.divmod(keys.take(one)[free], max(count, 1)), axis=1)


def side_pairs(faces: Ints, count: int, slots: Ints | None = None) -> tuple[Ints, tuple[Ints, Ints]]:
    """Pair sides that are the two of an edge.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    count : int
        Number of vertices.
    slots : ndarray, (s,) int64, optional
        Sides as `corner * m + face`; all where not given.

    Returns
    -------
    keys : ndarray, (s,) int64
        The edge of each side: `low * count + high`.
    one, other : ndarray, (e,) int64
        The two sides of each edge that has exactly two, as places in `keys`, in ascending order of the edges.
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=0).ravel()
    if slots is not None:
        start, end = start.take(slots), end.take(slots)
    keys = np.minimum(start, end) * count + np.maximum(start, end)
    order = sorting_order(keys)
    first = np.flatnonzero(np.diff(keys.take(order), prepend=-1))
    two = first[np.diff(first, append=len(keys)) == 2]
    return keys, (order.take(two), order.take(two + 1))


def _joined(faces: Ints, count: int, one: Ints, other: Ints) -> Bools:
    """Tell which pairs of vertices are joined by an edge."""
    wanted = np.minimum(one, other) * count + np.maximum(one, other)
    # most sides are told apart by a few bits of both their vertices
    bits = max(len(wanted) * 8, 2).bit_length()
    table = np.zeros(1 << bits, bool)
    table[_mixed(one, bits) ^ _mixed(other, bits)] = True
    corner = [_mixed(row, bits) for row in faces]
    found = []
    for side in range(3):
        start, end = side, (side + 1) % 3
        face = np.flatnonzero(table.take(corner[start] ^ corner[end]))
        a, b = faces[start].take(face), faces[end].take(face)
        found.append(np.minimum(a, b) * count + np.maximum(a, b))
    return np.isin(wanted, np.concatenate(found))


def _mixed(vertices: Ints, bits: int) -> Ints:
    return ((vertices.astype(np.uint64) * _MIXER) >> np.uint64(64 - bits)).view(np.int64)


def _rows(values: ArrayLike, shape: tuple[int, ...], kind: str) -> np.ndarray:
    array = np.asarray(values)
    if array.shape[: len(shape)] != shape:
        raise MeshError(f"a {kind} attribute has shape {array.shape}: it must begin with {shape}")
    rows = array.reshape(int(np.prod(shape)), int(np.prod(array.shape[len(shape) :])))
    if rows.dtype.kind == "f":
        rows = np.where(np.isnan(rows), np.inf, rows)  # equal to itself
    return rows


def _corners_of_ends(faces: Ints, sides: Ints) -> tuple[Ints, Ints]:
    """Return the corner, `face * 3 + number`, of the lower and of the higher vertex of each side."""
    width = len(faces)
    face, number = sides % width, sides // width
    start, end = face * 3 + number, face * 3 + (number + 1) % 3
    corners = faces.ravel()
    rising = corners.take(start) < corners.take(end)
    return np.where(rising, start, end), np.where(rising, end, start)
