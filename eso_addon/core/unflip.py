# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns back the UV triangles of a level that lie the other way round than the original faces that they come from."""

from __future__ import annotations

import numpy as np

from .mesh import Bools, Floats, Ints

_ROUNDS = 3
# a point may go so far, in sides of its triangles
_FAR = 0.25


def turned_back(uv: Floats, faces: Ints, turns: Floats, movable: Bools) -> tuple[Floats, Bools]:
    """Move UV points to the middle of their neighbours where triangles are turned over.

    Parameters
    ----------
    uv : ndarray, (w, 2) float64
    faces : ndarray, (m, 3) int64
        The points of each triangle.
    turns : ndarray, (m,) float64
        Above zero where a triangle should run counterclockwise, below where clockwise, zero where neither.
    movable : ndarray, (w,) bool
        Points that may move: not those on lines.

    Returns
    -------
    uv : ndarray, (w, 2) float64
    still : ndarray, (m,) bool
        Triangles that are turned all the same.
    """
    start, uv = uv, uv.copy()
    bad = _turned(uv, faces, turns)
    for _ in range(_ROUNDS):
        if not bad.any():
            return uv, bad
        moving = np.unique(faces[bad])
        moving = moving[movable.take(moving)]
        beside = np.zeros(len(uv), bool)
        beside[moving] = True
        uv[moving] = _middles(uv, faces.compress(beside.take(faces).any(axis=1), axis=0), moving)
        bad = _turned(uv, faces, turns)
    # what did not help, or went far, is taken back
    size = np.zeros(len(uv))
    for corner in range(3):
        side = start.take(faces[:, corner], axis=0) - start.take(faces[:, corner - 1], axis=0)
        np.maximum.at(size, faces[:, corner], np.hypot(side[:, 0], side[:, 1]))
    back = np.hypot(*(uv - start).T) > _FAR * size
    back[faces[bad]] = True
    uv[back] = start[back]
    return uv, _turned(uv, faces, turns)


def _turned(uv: Floats, faces: Ints, turns: Floats) -> Bools:
    a, b, c = (uv.take(column, axis=0) for column in faces.T)
    one, other = b - a, c - a
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return np.asarray((turns != 0) & (area * np.sign(turns) <= 0))


def areas_of(uv: Floats) -> Floats:
    """Return twice the area of UV triangles, (m, 3, 2), below zero where they run clockwise."""
    one, other = uv[:, 1].astype(np.float64) - uv[:, 0], uv[:, 2].astype(np.float64) - uv[:, 0]
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _middles(uv: Floats, faces: Ints, points: Ints) -> Floats:
    """Return the mean of the neighbours of points, each counted in every face that it shares with the point."""
    count = np.zeros(len(uv))
    sums = np.zeros((2, len(uv)))
    for corner in range(3):
        point = faces[:, corner]
        count += np.bincount(point, minlength=len(uv)) * 2
        for axis in range(2):
            others = uv[:, axis].take(faces[:, (corner + 1) % 3]) + uv[:, axis].take(faces[:, (corner + 2) % 3])
            sums[axis] += np.bincount(point, others, len(uv))
    return (sums.take(points, axis=1) / np.maximum(count.take(points), 1)).T


def mapped_by_source(places: Floats, source: Floats, source_uv: Floats) -> Floats:
    """Return UV of triangles by the maps of the faces that they come from, (k, 3, 2): never turned over.

    Parameters
    ----------
    places, source : ndarray, (k, 3, 3) float64
        Corners of the triangles, and of their source faces.
    source_uv : ndarray, (k, 3, 2) float64
    """
    base, one, other = source[:, 0], source[:, 1] - source[:, 0], source[:, 2] - source[:, 0]
    aa, ab, bb = (one * one).sum(axis=1), (one * other).sum(axis=1), (other * other).sum(axis=1)
    scale = 1 / np.maximum(aa * bb - ab * ab, 1e-300)
    offset = places - base[:, None]
    pa, pb = (offset * one[:, None]).sum(axis=2), (offset * other[:, None]).sum(axis=2)
    second = (bb[:, None] * pa - ab[:, None] * pb) * scale[:, None]
    third = (aa[:, None] * pb - ab[:, None] * pa) * scale[:, None]
    u, v = source_uv[:, 1] - source_uv[:, 0], source_uv[:, 2] - source_uv[:, 0]
    return np.asarray(source_uv[:, :1] + second[:, :, None] * u[:, None] + third[:, :, None] * v[:, None])
