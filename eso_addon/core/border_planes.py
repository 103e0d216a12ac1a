# SPDX-License-Identifier: GPL-3.0-or-later
"""Open borders in a plane of two axes, as where halves are mirrored and tiles set side by side: they stay in it."""

import numpy as np

from .guard import hold_flips
from .mesh import Bools, Floats, Ints, bounds

_THIN = 1e-5  # of the mesh: borders that leave a plane by less are meant to lie in it


def planar_edges(points: Floats, edges: Ints) -> Bools:
    """Tell along which axes edges lie in a plane of the two others, each together with one beside it: (3, e) bool.

    Parameters
    ----------
    points : (3, n) float64
    edges : (2, e) int64
    """
    leaves = np.abs(points.take(edges[1], axis=1) - points.take(edges[0], axis=1)) > _thickness(points)
    straight = np.ones(points.shape, bool)
    for flags, out in zip(straight, leaves, strict=True):
        flags[edges.compress(out, axis=1)] = False
    return ~leaves & straight.take(edges, axis=1).any(axis=1)


def into_planes(vertices: Floats, faces: Ints, points: Floats, borders: Ints, vertex_map: Ints) -> tuple[Floats, Bools]:
    """Put vertices of borders that run in a plane of two axes back into it, so that mirrored halves and tiles fit.

    A vertex stands for the edges that end in what has become it: it lies where those do that are planar along an axis,
    if all these agree. Where a face would turn it goes a part of the way, or none.

    Parameters
    ----------
    vertices, faces : (k, 3) float64 and (m, 3) int64
        The simplified mesh.
    points : (3, n) float64
        The original's.
    borders : (2, e) int64
    vertex_map : (n,) int64
        The simplified vertex that each has become, below zero if none.

    Returns
    -------
    vertices : (k, 3) float64
    held : (k, 3) bool
        The coordinates that must stay.
    """
    planar, ends = planar_edges(points, borders), points.take(borders, axis=1)
    # each edge tells both of its ends between which coordinates it lies
    owner = vertex_map.take(borders).ravel()
    order = np.argsort(owner, kind="stable")[np.count_nonzero(owner < 0):]
    chosen, begin = np.unique(owner.take(order), return_index=True)
    edge = order % max(borders.shape[1], 1)
    low = np.minimum.reduceat(np.where(planar, ends.min(axis=1), np.inf).take(edge, axis=1), begin, axis=1).T
    high = np.maximum.reduceat(np.where(planar, ends.max(axis=1), -np.inf).take(edge, axis=1), begin, axis=1).T
    held, goal = np.zeros(vertices.shape, bool), vertices.copy()
    held[chosen] = (low <= high) & (high - low <= _thickness(points))
    goal[chosen] = goal[chosen].clip(low, high)
    step, share = np.where(held, goal - vertices, 0), np.ones(len(vertices))
    hold_flips(vertices, step, share, faces, vertices, np.flatnonzero(step.any(axis=1).take(faces).any(axis=1)))
    held &= (share == 1)[:, None]
    return np.where(held, goal, vertices + share[:, None] * step), held


def _thickness(points: Floats) -> float:
    """Return by how much what is meant to lie in a plane may leave it."""
    low, high = bounds(points.T)
    return _THIN * float((high - low).max(initial=0))
