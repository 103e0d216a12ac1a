# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as triangles with their diagonals marked, and back."""

from __future__ import annotations

import numpy as np

from ..core.adjacency import components
from ..core.mesh import Bools, Ints

DIAGONAL, FIRST, POLYGON, CORNER = ".diagonal", ".first", ".polygon", ".corner"
NORMALS, STORED_NORMALS, GROUP, KEY = ".normals", ".custom_normal", ".group.", ".key."


def is_apart(name: str) -> bool:
    """Tell whether an attribute is no attribute of Blender's, but something else of a mesh."""
    return name in (DIAGONAL, FIRST, POLYGON, CORNER, NORMALS, STORED_NORMALS) or name.startswith((GROUP, KEY))


def mark_polygons(faces: Ints, corners: Ints, polygon: Ints, starts: Ints, *,
                  keep_order: bool) -> dict[str, dict[str, np.ndarray]]:
    """Return the attributes by which `find_polygons` finds the polygons of triangles; none where all are triangles.

    Parameters
    ----------
    faces, corners : ndarray, (m, 3) int64
        Vertices of each triangle, and corners of the polygons.
    polygon : ndarray, (m,) int64
        The polygon of each triangle.
    starts : ndarray, (p + 1,) int64
        The corners of each polygon, one after the other.
    keep_order : bool
        Tell which corner of a polygon is its first.
    """
    size = np.diff(starts)
    if (size == 3).all() and len(polygon) == len(size):
        return {}
    local = corners - starts.take(polygon)[:, None]
    inside = (local + 1) % size.take(polygon)[:, None] != np.roll(local, -1, axis=1)
    marks = {"side": {DIAGONAL: inside}}
    if keep_order:
        marks["side"][FIRST] = (local == 0) & ~inside
    slots, found = find_polygons(faces, marks)
    mine = polygon.take(slots.take(found[:-1]) // 3)
    told = np.array_equal(np.sort(mine), np.arange(len(size))) and np.array_equal(np.diff(found), size.take(mine))
    if told:
        follows = corners.ravel().take(slots)
        turned = follows - np.repeat(starts.take(mine), size.take(mine))
        step = np.diff(turned) % np.repeat(size.take(mine), size.take(mine))[1:]
        inner = np.ones(len(turned), bool)
        inner[found[:-1]] = False
        told = bool((step[inner[1:]] == 1).all()) and (not keep_order or bool((turned[found[:-1]] == 0).all()))
    if told:
        return marks
    return {"face": {POLYGON: polygon.astype(np.int32)}, "side": {CORNER: local.astype(np.int32)}}


def find_polygons(faces: Ints, attributes: dict[str, dict[str, np.ndarray]]) -> tuple[Ints, Ints]:
    """Return the polygons of triangles.

    Parameters
    ----------
    faces : ndarray, (m, 3) int64
    attributes : dict
        As `mark_polygons` gives them.

    Returns
    -------
    slots : ndarray, (corners,) int64
        For each corner of the polygons the triangle's corner, 3 * face + number.
    starts : ndarray, (p + 1,) int64
    """
    side, count = attributes.get("side", {}), len(faces)
    if POLYGON in attributes.get("face", {}) and CORNER in side:
        return _told(attributes["face"][POLYGON], side[CORNER])
    if DIAGONAL not in side:
        return np.arange(3 * count), np.arange(0, 3 * count + 1, 3)
    inside = side[DIAGONAL].astype(bool)
    group = _joined(faces, inside)
    slots = np.flatnonzero(~inside)
    owner = group.take(slots // 3)
    follower = _followers(faces, slots, owner)
    sizes, triangles = np.bincount(owner, minlength=count), np.bincount(group, minlength=count)
    # whatever is not one round of its corners falls apart into its triangles
    broken = (triangles > 0) & (sizes != triangles + 2)
    broken[owner[follower < 0]] = True
    first = np.full(count, -1)
    first[owner[::-1]] = np.arange(len(slots))[::-1]
    if FIRST in side:
        chosen = np.flatnonzero(side[FIRST].ravel().take(slots))
        first[owner[chosen]] = chosen
    place = _walk(first, follower, owner, sizes, broken)
    whole = np.flatnonzero(~broken.take(owner))
    lone = np.flatnonzero(broken.take(group))
    return _ordered(slots.take(whole), owner.take(whole), place.take(whole), lone)


def _told(polygon: Ints, corner: Ints) -> tuple[Ints, Ints]:
    """Return polygons whose corners are numbered."""
    owner = np.repeat(polygon.astype(np.int64), 3)
    keys = owner * (int(corner.max(initial=0)) + 1) + corner.ravel()
    keys, slots = np.unique(keys, return_index=True)
    change = np.flatnonzero(np.diff(owner.take(slots), prepend=-1))
    return slots, np.append(change, len(slots))


def _joined(faces: Ints, inside: Bools) -> Ints:
    """Return the group of each triangle: those with a diagonal between them, by their lowest triangle."""
    count = int(faces.max(initial=-1)) + 1
    slots = np.flatnonzero(inside)
    one, other = faces.ravel().take(slots), np.roll(faces, -1, axis=1).ravel().take(slots)
    keys, order = np.unique(one * count + other, return_index=True)
    place = np.searchsorted(keys, other * count + one).clip(max=max(len(keys) - 1, 0))
    met = np.flatnonzero(keys.take(place) == other * count + one) if len(keys) else slots
    group = components(len(faces), slots.take(met) // 3, slots.take(order.take(place.take(met))) // 3)
    lowest = np.full(len(faces), len(faces))
    np.minimum.at(lowest, group, np.arange(len(faces)))
    return lowest.take(group)


def _followers(faces: Ints, slots: Ints, owner: Ints) -> Ints:
    """Return for each outer side the one of its group that starts where it ends; -1 where there is not just one."""
    count = int(faces.max(initial=-1)) + 1
    starts, ends = (owner * count + corners.ravel().take(slots) for corners in (faces, np.roll(faces, -1, axis=1)))
    order = np.argsort(starts, kind="stable")
    keys = starts.take(order)
    left, right = np.searchsorted(keys, ends, "left"), np.searchsorted(keys, ends, "right")
    return np.where(right - left == 1, order.take(left, mode="clip"), -1) if len(order) else order


def _walk(first: Ints, follower: Ints, owner: Ints, sizes: Ints, broken: Bools) -> Ints:
    """Count the sides of each group from its first one; mark groups that are not one round as broken."""
    place = np.full(len(follower), -1)
    current = first[(first >= 0) & ~broken]
    step = 0
    while len(current):
        place[current] = step
        step += 1
        onward = follower.take(current)
        again = place.take(onward) >= 0
        broken[owner[current[again & (sizes.take(owner.take(current)) != step)]]] = True
        current = onward[~again]
    return place


def _ordered(slots: Ints, owner: Ints, place: Ints, lone: Ints) -> tuple[Ints, Ints]:
    """Put polygons in the order of their lowest triangles, triangles that stay alone among them."""
    slots = np.concatenate((slots, (3 * lone[:, None] + np.arange(3)).ravel()))
    owner = np.concatenate((owner, np.repeat(lone, 3)))
    place = np.concatenate((place, np.tile(np.arange(3), len(lone))))
    order = np.lexsort((place, owner))
    owner = owner.take(order)
    change = np.flatnonzero(np.diff(owner, prepend=-1))
    return slots.take(order), np.append(change, len(owner))
