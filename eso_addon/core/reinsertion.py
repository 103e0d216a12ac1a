# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts back into a simplified mesh the original vertices that lie farthest from it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .normals import lengths

Bools = NDArray[np.bool_]
Floats = NDArray[Any]  # float64, or float32 where only a choice hangs on it
Ints = NDArray[np.int64]

_SHARE = 100  # one vertex for so many triangles: it costs two of them
_INSIDE = 0.1  # least weight of a corner where a vertex goes into the face; else it goes onto the side opposite
_SHAPE = 0.02  # least area over squared edges of the new faces
_ROUNDING = 1e-12  # squared distances of vertices that lie on the surface, which has about unit size
_ROUNDS = 8
_ROOM = 16  # candidates for each vertex that is wanted


def spare_vertices(triangles: int) -> int:
    """Return how many vertices a level of so many triangles may get back."""
    return triangles // _SHARE


def with_parts(values: Ints, corner: Ints) -> Ints:
    """Return values of faces, (m,), also for those that were split off them, by their corners as in `Reinserted`."""
    return np.concatenate((values, values.take(corner[len(values):, 0] // 3)))


class Reinserted(NamedTuple):
    """A mesh with vertices put back.

    Attributes
    ----------
    chosen : ndarray, (c,) int64
        The candidates that came in, by falling distance; they are the last c vertices.
    faces : ndarray, (m + 2 c, 3) int64
        The given faces in their places, those that were split smaller, and the new ones.
    corner : ndarray, (m + 2 c, 3) int64
        The corner that each was, as 3 * face + number; of a new vertex one of a face that it split.
    """

    chosen: Ints
    faces: Ints
    corner: Ints


def reinsert(vertices: Floats, faces: Ints, neighbors: Ints, points: Floats, squared: Floats, face: Ints,
             weights: Floats, wanted: int, free: Bools) -> Reinserted:
    """Split faces where candidates lie farthest from them, so that these become vertices of the mesh.

    Parameters
    ----------
    vertices, faces : (k, 3) float64 and (m, 3) int64
    neighbors : (3, m) int64
        The face across each side, the face itself where there is none.
    points : (3, s) float64
        The candidates.
    squared, face : (s,)
        Squared distance of each, and the face that is closest.
    weights : (3, s) float64
        Barycentric coordinates of the closest point.
    wanted : int
        Vertices to put back; fewer where faces are too few to keep them apart.
    free : (3, m) bool
        Sides that may be split.
    """
    order = np.flatnonzero(squared > _ROUNDING)
    order = order.take(np.lexsort((order, -squared.take(order))))[: _ROOM * wanted]
    face, weights = face.take(order), weights.take(order, axis=1)
    lightest = weights.argmin(axis=0)
    inside = weights.min(axis=0) >= _INSIDE
    x, y = (lightest + 1) % 3, (lightest + 2) % 3
    other = np.where(inside, face, neighbors[x, face])
    # the side from x to y runs the other way in the other face
    there = (faces.take(other, axis=0) == faces[face, y][:, None]).argmax(axis=1)
    fits = (other != face) & free[x, face] & (faces[other, (there + 1) % 3] == faces[face, x])
    own = np.array([3 * face + corner for corner in (lightest, x, y)])
    far = np.array([3 * other + (there + turn) % 3 for turn in (2, 0, 1)])
    fits = (inside | fits) & _sound(vertices, faces, own, np.where(inside, own, far), points.take(order, axis=1).T)
    possible = np.flatnonzero(fits)
    won = possible.take(_apart(face.take(possible), other.take(possible), neighbors)[:wanted])
    return _split(faces, order.take(won), own.take(won, axis=1), far.take(won, axis=1), inside.take(won), len(vertices))


def _sound(vertices: Floats, faces: Ints, own: Ints, far: Ints, points: Floats) -> Bools:
    """Tell the points that split both faces into well-shaped ones that look the same way."""
    sound = np.ones(len(points), bool)
    for slots in (own, far):
        corners = vertices.take(faces.ravel().take(slots), axis=0)
        whole = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        for start, end in ((0, 1), (2, 0)):
            along, to = corners[end] - corners[start], points - corners[start]
            piece = np.cross(along, to)
            squares = sum(np.einsum("ij,ij->i", row, row) for row in (along, to, to - along))
            sound &= np.einsum("ij,ij->i", piece, whole) > 0
            sound &= lengths(piece) > 2 * _SHAPE * squares
    return sound


def _apart(face: Ints, other: Ints, neighbors: Ints) -> Ints:
    """Return candidates, the first first, no two of which split faces that are the same or side by side."""
    ring = np.concatenate((face[None], other[None], neighbors.take(face, axis=1), neighbors.take(other, axis=1)))
    rank = np.arange(len(face))
    taken = np.zeros(neighbors.shape[1], bool)
    chosen: list[Ints] = []
    for _ in range(_ROUNDS):
        best = np.full(neighbors.shape[1], len(face))
        np.minimum.at(best, ring.take(rank, axis=1).ravel(), np.tile(rank, len(ring)))
        first = rank.compress((best.take(ring.take(rank, axis=1)) == rank).all(axis=0))
        chosen.append(first)
        taken[ring.take(first, axis=1)] = True
        rank = rank.compress(~taken.take(ring.take(rank, axis=1)).any(axis=0))
        if len(rank) == 0:
            break
    return np.sort(np.concatenate(chosen))


def _split(faces: Ints, chosen: Ints, own: Ints, far: Ints, inside: Bools, vertex_count: int) -> Reinserted:
    """Split each face (a, x, y) by a vertex p, or with it the face (o, y, x) across the side from x to y."""
    corner, new = np.arange(faces.size).reshape(faces.shape), np.empty((2 * len(chosen), 3), np.int64)
    is_new = np.zeros((len(faces) + len(new), 3), bool)
    a, x, y = own
    o, far_y, far_x = far
    face, across = a // 3, np.flatnonzero(~inside)
    other = o.take(across) // 3
    # p is nothing that was there: it stands for another corner of its face
    corner[face] = np.stack((a, x, a), axis=1)
    new[0::2] = np.where(inside[:, None], np.stack((x, y, x), axis=1), np.stack((a, a, y), axis=1))
    new[1::2] = np.where(inside[:, None], np.stack((y, a, y), axis=1), np.stack((o, o, far_x), axis=1))
    corner[other] = np.stack((o, far_y, o), axis=1)[across]
    corner = np.concatenate((corner, new))
    is_new[face, 2] = is_new[other, 2] = True
    is_new[len(faces):] = np.repeat(np.where(inside[:, None], [False, False, True], [False, True, False]), 2, axis=0)
    number = np.zeros(len(corner), np.int64)
    number[face] = np.arange(len(chosen))
    number[other] = across
    number[len(faces):] = np.repeat(np.arange(len(chosen)), 2)
    split = np.where(is_new, vertex_count + number[:, None], faces.ravel().take(corner))
    return Reinserted(chosen, split, corner)
