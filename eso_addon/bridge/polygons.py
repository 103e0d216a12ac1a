# SPDX-License-Identifier: GPL-3.0-or-later
"""Quads and n-gons again: where all triangles of a polygon are left as they were, or may be joined."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


class Polygons(NamedTuple):
    """Polygons made of triangles.

    Attributes
    ----------
    starts : ndarray, (p,) int64
        Where each polygon's corners begin.
    slots : ndarray, (l,) int64
        For each corner a corner of the triangles, 3 * triangle + number.
    source : ndarray, (p,) int64
        The polygon that each comes from.
    """

    starts: Ints
    slots: Ints
    source: Ints


def triangles_alone(polygon: Ints) -> Polygons:
    """Give triangles as they are; `polygon` is the source's polygon of each, (m,) int64."""
    return Polygons(np.arange(len(polygon)) * 3, np.arange(len(polygon) * 3), polygon)


def polygons_again(faces: Ints, moved: NDArray[np.bool_], corner: Ints, polygon: Ints, sizes: Ints, *,
                   join: bool) -> Polygons:
    """Put triangles together to the polygons that they come from.

    Parameters
    ----------
    faces : ndarray, (m, 3) int64
        Vertices of the triangles.
    moved : ndarray, (m,) bool
        Triangles with a vertex that is not where it was.
    corner : ndarray, (m, 3) int64
        The source's corner at each corner.
    polygon : ndarray, (m,) int64
        The source's polygon of each triangle.
    sizes : ndarray, (p,) int64
        Corners of the source's polygons.
    join : bool
        Quads are put together too where they have moved.

    Returns
    -------
    Polygons
        In the order of the triangles.
    """
    count = len(sizes)
    whole = np.bincount(polygon, minlength=count) == sizes - 2
    loose = np.bincount(polygon, moved, minlength=count) > 0
    whole &= (sizes > 3) & (~loose | (join & (sizes == 4)))
    whole &= ~_torn(faces, corner, polygon, whole)
    joined = np.flatnonzero(whole.take(polygon))
    # one slot for each of the source's corners, in its order: corners of a polygon follow each other
    order = joined[:, None] * 3 + np.arange(3)
    corners, first = np.unique(corner.ravel().take(order.ravel()), return_index=True)
    slots = order.ravel().take(first)
    owner = polygon.take(slots // 3)
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    single = np.flatnonzero(~whole.take(polygon))
    # each polygon stands where its first triangle does
    first_triangle = np.full(count, len(polygon))
    np.minimum.at(first_triangle, polygon.take(joined), joined)
    place = np.concatenate((single, first_triangle.take(owner.take(starts))))
    size = np.concatenate((np.full(len(single), 3), np.diff(np.append(starts, len(slots)))))
    begin = np.concatenate((np.arange(len(single)) * 3, len(single) * 3 + starts))
    every = np.concatenate(((single[:, None] * 3 + np.arange(3)).ravel(), slots))
    rank = np.argsort(place, kind="stable")
    size, begin = size.take(rank), begin.take(rank)
    ends = np.cumsum(size)
    within = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - size, size)
    slots = every.take(np.repeat(begin, size) + within)
    source = np.concatenate((polygon.take(single), owner.take(starts))).take(rank)
    return Polygons(ends - size, slots, source)


def _torn(faces: Ints, corner: Ints, polygon: Ints, whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell polygons where a corner has become two vertices, or two corners one."""
    chosen = np.flatnonzero(whole.take(polygon))
    corners, vertices = corner.take(chosen, axis=0).ravel(), faces.take(chosen, axis=0).ravel()
    owner = np.repeat(polygon.take(chosen), 3)
    torn = np.zeros(len(whole), bool)
    for one, other in ((corners, vertices), (vertices, corners)):
        order = np.lexsort((other, one, owner))
        same = (np.diff(owner.take(order)) == 0) & (np.diff(one.take(order)) == 0) & (np.diff(other.take(order)) != 0)
        torn[owner.take(order[1:][same])] = True
    return torn
