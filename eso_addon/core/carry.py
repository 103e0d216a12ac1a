# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes after the collapse: those of the original surface at the new place, each side of a line from its own side.

Every vertex of a level stands for a part of the original: the vertices that were collapsed into it. Each of its
corners takes its values from the point closest to it on the faces around that part, on its own side of every line.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .adjacency import components
from .closest import closest_in_triangles, squared_distances, triangle_frames
from .lines import Lines
from .mesh import Floats, Ints

_BLOCK = 16384


class Places(NamedTuple):
    """Where the corners of a level lie on the original.

    Attributes
    ----------
    number : ndarray, (w,) int64
        The wedge of the level that each of the engine's wedges has become.
    target : ndarray, (3, m) int64
        The same for each corner of the engine's faces.
    face : ndarray, (t,) int64
        The engine's face that each wedge lies on.
    weights : ndarray, (3, t) float64
        How much each of that face's corners counts there.
    vertex : ndarray, (t,) int64
        The vertex of the level at each wedge.
    """

    number: Ints
    target: Ints
    face: Ints
    weights: Floats
    vertex: Ints


class Ground:
    """What of the original every level is laid on; kept, so that a second level costs less.

    Parameters
    ----------
    lines : Lines
        Of the engine's mesh.
    points : ndarray, (3, n) float64
        The engine's vertices where they stood, in the level's units.
    """

    def __init__(self, lines: Lines, points: Floats) -> None:
        self.lines, self.points = lines, points
        wedges = lines.wedge.ravel()
        self.slot = np.zeros(int(wedges.max(initial=-1)) + 1, np.int64)  # (w,) the first corner of each wedge
        self.slot[wedges[::-1]] = np.arange(len(wedges))[::-1]
        self.vertex = lines.faces.ravel().take(self.slot)
        self.places = points.take(self.vertex, axis=1)
        self._frames = np.empty((15, lines.faces.shape[1]))
        self._framed = np.zeros(lines.faces.shape[1], bool)

    @cached_property
    def spheres(self) -> Floats:
        """(4, m): a centre and a radius around each face."""
        a, b, c = (self.points.take(row, axis=1) for row in self.lines.faces)
        middle = (a + b + c) / 3
        far = np.maximum(np.maximum(_square(a - middle), _square(b - middle)), _square(c - middle))
        return np.concatenate((middle, np.sqrt(far)[None]))

    def frames(self, faces: Ints) -> Floats:
        """Return the frames of all faces, (15, m); only those that were asked for once have been written."""
        asked = np.zeros(len(self._framed), bool)
        asked[faces] = True
        new = np.flatnonzero(asked & ~self._framed)
        if len(new):
            corners = np.ascontiguousarray(self.lines.faces.take(new, axis=1).T)
            self._frames[:, new] = triangle_frames(self.points.T, corners)
            self._framed[new] = True
        return self._frames


def find_places(ground: Ground, survivor: Ints, placed: Floats) -> Places:
    """Find where each wedge of a level lies on the original.

    Parameters
    ----------
    ground : Ground
    survivor : ndarray, (n,) int64
        The level's vertex that each has become.
    placed : ndarray, (3, k) float64
        Positions of the level's vertices.
    """
    faces = ground.lines.faces
    number, vertex = _targets(ground, survivor.take(faces), survivor)
    target = number.take(ground.lines.wedge)
    there = placed.take(vertex, axis=1)
    corner, reach = _nearest_corners(ground, number, there)
    count = faces.shape[1]
    face, weights = corner % count, np.zeros((3, len(vertex)))
    weights[corner // count, np.arange(len(vertex))] = 1
    moved = np.flatnonzero(reach > 0)
    if len(moved):
        face[moved], weights[:, moved] = _closest(ground, target, there, reach, moved)
    return Places(number, target, face, weights, vertex)


def _targets(ground: Ground, merged: Ints, survivor: Ints) -> tuple[Ints, Ints]:
    """Return the level's wedge that each of the original's has become, and the vertex of each of the level's.

    Wedges become one where their vertices do and a face has both: that face is on one side of every line.
    """
    wedge, count = ground.lines.wedge, len(ground.slot)
    vertex_of = survivor.take(ground.vertex)
    # a vertex that stands for no line has one wedge, whatever became it
    lined = np.zeros(int(survivor.max(initial=-1)) + 1, bool)
    lined[survivor.compress(ground.lines.parted)] = True
    first = np.full(len(lined), count)
    first[vertex_of[::-1]] = np.arange(count)[::-1]  # of several the first holds
    on_line = lined.take(vertex_of)
    number = np.where(on_line, np.arange(count), first.take(vertex_of))
    ones, others = [], []
    for side in range(3):
        following = (side + 1) % 3
        inside = np.flatnonzero((merged[side] == merged[following]) & lined.take(merged[side]))
        ones.append(wedge[side].take(inside))
        others.append(wedge[following].take(inside))
    part = components(count, np.concatenate(ones), np.concatenate(others))
    names, number = numbered(np.where(on_line, count + part, number), 2 * count)
    vertex = np.zeros(len(names), np.int64)
    vertex[number] = vertex_of
    return number, vertex


def numbered(keys: Ints, bound: int) -> tuple[Ints, Ints]:
    """Return what `np.unique` does with the inverse, of whole numbers below a bound; without sorting if few."""
    if bound > 8 * len(keys) + 1024:
        names, number = np.unique(keys, return_inverse=True)
        return names, number.ravel()
    there = np.zeros(bound, bool)
    there[keys] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1).take(keys)


def positions(names: Ints, wanted: Ints, bound: int) -> Ints:
    """Return where each of the wanted is among ascending names, -1 where it is not, or is below zero."""
    if bound > 8 * len(wanted) + 1024:
        found = np.searchsorted(names, wanted).clip(max=len(names) - 1)
        return np.where(names[found] == wanted, found, -1)
    table = np.full(bound + 1, -1)
    table[names] = np.arange(len(names))
    return table.take(wanted)


def _nearest_corners(ground: Ground, number: Ints, there: Floats) -> tuple[Ints, Floats]:
    """Return, for each of a level's wedges, the nearest corner that became it, as a slot, and how far that is."""
    offset = ground.places - there.take(number, axis=1)
    far = np.sqrt(_square(offset))
    reach = np.full(there.shape[1], np.inf)
    np.minimum.at(reach, number, far)
    won = np.flatnonzero(far <= reach.take(number))
    corner = np.full(there.shape[1], ground.lines.faces.size)
    np.minimum.at(corner, number.take(won), ground.slot.take(won))  # of equals the first
    return corner, reach


def _closest(ground: Ground, target: Ints, there: Floats, reach: Floats, moved: Ints) -> tuple[Ints, Floats]:
    """Return the closest faces, among those with a corner in the wedge, of the wedges `moved`, and weights in them."""
    faces, wedges, offset = _near(ground, target, there, reach)
    frames = ground.frames(faces)
    radius, offset = ground.spheres[3].take(faces), np.sqrt(offset)
    # the face whose middle is nearest tells how close the closest is at least: most others are further away
    first = _least(offset, wedges, there.shape[1]).take(moved)
    reach = np.zeros(there.shape[1])
    reach[moved] = np.sqrt(squared_distances(frames.take(faces.take(first), axis=1), there.take(moved, axis=1)))
    left = np.flatnonzero(offset <= (reach.take(wedges) + radius) * (1 + 1e-9))
    faces, wedges = faces.take(left), wedges.take(left)
    squared = np.empty(len(faces))
    for part in _parts(len(faces), _BLOCK // 4):
        squared[part] = squared_distances(frames.take(faces[part], axis=1), there.take(wedges[part], axis=1))
    face = faces.take(_least(squared, wedges, there.shape[1]).take(moved))
    place = closest_in_triangles(frames.take(face, axis=1), there.take(moved, axis=1))[0]
    return face, _barycentric(ground.points, ground.lines.faces.take(face, axis=1), place)


def _near(ground: Ground, target: Ints, there: Floats, reach: Floats) -> tuple[Ints, Ints, Floats]:
    """Return the faces that may come closer to a wedge than its nearest corner: faces, wedges, squares to middles."""
    limit = reach * (1 + 1e-9)
    moved, found = reach > 0, []
    for part in _parts(target.shape[1], _BLOCK):
        for side in range(3):
            new = moved.take(target[side, part])
            for before in range(side):
                new &= target[before, part] != target[side, part]
            face = np.flatnonzero(new) + part.start
            own = target[side].take(face)
            sphere = ground.spheres.take(face, axis=1)
            offset = _square(sphere[:3] - there.take(own, axis=1))
            within = np.flatnonzero(offset <= (limit.take(own) + sphere[3]) ** 2)
            found.append((face.take(within), own.take(within), offset.take(within)))
    faces, wedges, offsets = (np.concatenate(rows) for rows in zip(*found, strict=True))
    return faces, wedges, offsets


def _least(values: Floats, wedges: Ints, count: int) -> Ints:
    """Return which of the values is the least of each wedge, of equals the first; 0 where a wedge has none."""
    best = np.full(count, np.inf)
    np.minimum.at(best, wedges, values)
    won = np.flatnonzero(values <= best.take(wedges))[::-1]
    chosen = np.zeros(count, np.int64)
    chosen[wedges.take(won)] = won
    return chosen


def _parts(count: int, size: int) -> Iterator[slice]:
    """Yield slices that stay in the processor's cache."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


def _square(vectors: Floats) -> Floats:
    return vectors[0] * vectors[0] + vectors[1] * vectors[1] + vectors[2] * vectors[2]


def _barycentric(points: Floats, faces: Ints, places: Floats) -> Floats:
    """Return the (3, k) weights of the corners of (3, k) faces at places on them; on slivers along the longest side."""
    a, b, c = (points.take(row, axis=1) for row in faces)
    one, other, offset = b - a, c - a, places - a
    aa, ab, bb = _square(one), (one * other).sum(axis=0), _square(other)
    pa, pb = (one * offset).sum(axis=0), (other * offset).sum(axis=0)
    determinant = aa * bb - ab * ab
    flat = determinant <= 1e-14 * aa * bb
    scale = 1 / np.where(flat, 1, determinant)
    second, third = (bb * pa - ab * pb) * scale, (aa * pb - ab * pa) * scale
    along = aa >= bb
    second = np.where(flat, np.where(along, pa / np.maximum(aa, 1e-300), 0), second).clip(0, 1)
    third = np.where(flat, np.where(along, 0, pb / np.maximum(bb, 1e-300)), third).clip(0, 1 - second)
    weights = np.stack((1 - second - third, second, third))
    weights[weights < 1e-7] = 0
    return weights / weights.sum(axis=0)
