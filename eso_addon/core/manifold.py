# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a mesh is open, and faces that are wound against their neighbours."""

import numpy as np
from numpy.typing import NDArray

from .adjacency import components, sorting_order
from .mesh import Bools, Ints, hashes


def open_vertices(faces: Ints, count: int) -> Bools:
    """Find vertices with a side that no other face runs back along: at boundaries, odd and inconsistent edges.

    Each face runs along its sides; where the surface is closed and wound consistently, as many sides run from a to b
    as from b to a.
    Sums of hashed neighbours on either way tell the vertices where that fails, without a sort of the edges.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    count : int
        Number of vertices.

    Returns
    -------
    ndarray, (count,) bool
    """
    # whole numbers of 40 bits: their sums are exact, beyond thousands of neighbours a vertex may be named in vain
    hashed = (hashes(count) >> np.uint64(24)).astype(np.float64)
    values = [hashed.take(row) for row in faces]
    balance = np.zeros(count)
    for corner in range(3):
        balance += np.bincount(faces[corner], values[(corner + 1) % 3] - values[(corner + 2) % 3], count)
    return balance != 0


def boundary_sides(faces: Ints, opened: Bools) -> Ints:
    """Return the sides with no other face, as slots j * m + face, (b,) int64, of (3, m) faces.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    opened : ndarray, (n,) bool
        From `open_vertices`; only sides between two such vertices are looked at.
    """
    slots, start, end = _open_sides(faces, opened)
    keys = np.minimum(start, end) * len(opened) + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    keys = keys.take(order)
    alone = np.ones(len(keys), bool)
    same = keys[1:] == keys[:-1]
    alone[1:] &= ~same
    alone[:-1] &= ~same
    return slots.take(np.sort(order[alone]))


def _open_sides(faces: Ints, opened: Bools) -> tuple[Ints, Ints, Ints]:
    """Return the sides between two open vertices, as slots, and where they start and end."""
    if not opened.any():
        return (np.zeros(0, np.int64),) * 3
    width = faces.shape[1]
    at = [opened.take(row) for row in faces]
    slots = np.concatenate([np.flatnonzero(at[side] & at[(side + 1) % 3]) + side * width for side in range(3)])
    corners = faces.ravel()
    return slots, corners.take(slots), corners.take((slots + width) % max(len(corners), 1))


def boundary_fans(faces: Ints, opened: Bools) -> Ints:
    """Return how many runs of faces around each vertex go from boundary to boundary, (n,) int64; manifold: 0 or 1.

    Arguments as of `boundary_sides`.
    """
    sides = boundary_sides(faces, opened)
    corners, following = faces.ravel(), (sides + faces.shape[1]) % max(faces.size, 1)
    ends = np.concatenate((corners.take(sides), corners.take(following)))
    return np.bincount(ends, minlength=len(opened)) // 2


def orient(faces: Ints, count: int) -> Bools:
    """Find the faces to turn over so that neighbours run along their common edge in opposite ways.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    count : int
        Number of vertices.

    Returns
    -------
    ndarray, (m,) bool
        Of each connected part the fewer faces are turned. On a one-sided surface (Möbius) some edges stay as they are.
    """
    width = faces.shape[1]
    start, end = faces.ravel(), np.roll(faces, -1, axis=0).ravel()
    keys = np.minimum(start, end) * count + np.maximum(start, end)
    order = sorting_order(keys)
    keys = keys.take(order)
    first = np.flatnonzero(np.concatenate(([True], keys[1:] != keys[:-1])))
    pairs = first[np.diff(np.append(first, len(keys))) == 2]
    one, other = order.take(pairs), order.take(pairs + 1)
    against = (start.take(one) == start.take(other)).astype(np.int8)
    one, other = one % width, other % width
    turned = _two_colours(width, one, other, against)
    part = components(width, one, other)
    most = np.bincount(part, turned) * 2 > np.bincount(part)
    return (turned == 1) ^ most.take(part)


def _two_colours(count: int, one: Ints, other: Ints, differ: NDArray[np.int8]) -> NDArray[np.int8]:
    """Give each node of a graph 0 or 1 so that the ends of links differ where they should, as far as that can be.

    Like `components`: each root takes a lower root that it is linked to, and all paths are cut short.
    """
    root, colour = np.arange(count), np.zeros(count, np.int8)
    while True:
        low, high = root.take(one), root.take(other)
        apart = np.flatnonzero(low != high)
        if len(apart) == 0:
            return colour
        one, other, differ = one.take(apart), other.take(apart), differ.take(apart)
        low, high = low.take(apart), high.take(apart)
        turn = differ ^ colour.take(one) ^ colour.take(other)
        low, high = np.minimum(low, high), np.maximum(low, high)
        chosen = np.full(count, len(one))
        np.minimum.at(chosen, high, np.arange(len(one)))
        taken = np.flatnonzero(chosen < len(one))
        link = chosen.take(taken)
        above, relative = np.arange(count), np.zeros(count, np.int8)
        above[taken], relative[taken] = low.take(link), turn.take(link)
        while True:
            further = above.take(above)
            if np.array_equal(further, above):
                break
            relative ^= relative.take(above)
            above = further
        colour ^= relative.take(root)
        root = above.take(root)


def winding_conflicts(faces: Ints, opened: Bools) -> bool:
    """Tell whether two faces alone at an edge run along it the same way; arguments as of `boundary_sides`."""
    slots, start, end = _open_sides(faces, opened)
    if len(slots) == 0:
        return False
    keys = np.sort(((np.minimum(start, end) * len(opened) + np.maximum(start, end)) << 1) | (start < end))
    edges = keys >> 1
    pair = (edges[1:] == edges[:-1]) & (keys[1:] == keys[:-1])
    before = np.concatenate(([False], edges[1:-1] == edges[:-2])) if len(edges) > 1 else np.zeros(0, bool)
    after = np.concatenate((edges[2:] == edges[1:-1], [False])) if len(edges) > 1 else np.zeros(0, bool)
    return bool((pair & ~before & ~after).any())
