# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes after the collapse: those of the original surface at the new place, each side of a line from its own side.

Every vertex of a level stands for a part of the original: the vertices that were collapsed into it. Each of its
corners takes its values from the point closest to it on the faces around that part, on its own side of every line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .adjacency import components
from .blocks import Blocks
from .closest import closest_in_triangles, triangle_frames
from .lines import Lines
from .mesh import Floats, Ints

_BLOCK = 16384
_NONE = np.iinfo(np.int64).max


class Places(NamedTuple):
    """Where the corners of a level lie on the original.

    Attributes
    ----------
    target : ndarray, (3, m) int64
        For each corner of the engine's faces, the wedge of the level that it has become.
    face : ndarray, (t,) int64
        The engine's face that each wedge lies on.
    weights : ndarray, (3, t) float64
        How much each of that face's corners counts there.
    vertex : ndarray, (t,) int64
        The vertex of the level at each wedge.
    """

    target: Ints
    face: Ints
    weights: Floats
    vertex: Ints


def find_places(lines: Lines, points: Floats, survivor: Ints, placed: Floats, blocks: Blocks) -> Places:
    """Find where each wedge of a level lies on the original.

    Parameters
    ----------
    lines : Lines
        Of the engine's mesh.
    points : ndarray, (3, n) float64
        The engine's vertices where they stood, in the level's units.
    survivor : ndarray, (n,) int64
        The level's vertex that each has become.
    placed : ndarray, (3, k) float64
        Positions of the level's vertices.
    blocks : Blocks
    """
    faces = lines.faces
    merged = survivor.take(faces)
    target, vertex = _targets(lines, merged, survivor)
    there = placed.take(vertex, axis=1)
    corner = _nearest_corners(points, faces, target, there, blocks)
    count = faces.shape[1]
    face, weights = corner % count, np.zeros((3, len(vertex)))
    weights[corner // count, np.arange(len(vertex))] = 1
    moved = np.flatnonzero((points.take(faces.ravel().take(corner), axis=1) != there).any(axis=0))
    if len(moved):
        face[moved], weights[:, moved] = _closest(points, faces, target, there, corner, moved, blocks)
    return Places(target, face, weights, vertex)


def _targets(lines: Lines, merged: Ints, survivor: Ints) -> tuple[Ints, Ints]:
    """Return the level's wedge of each corner, (3, m), and the vertex of each wedge.

    Wedges become one where their vertices do and a face has both: that face is on one side of every line.
    """
    wedge = lines.wedge
    count = int(wedge.max(initial=-1)) + 1
    vertex_of = np.zeros(count, np.int64)
    vertex_of[wedge] = merged
    # a vertex that stands for no line has one wedge, whatever became it
    lined = np.zeros(int(survivor.max(initial=-1)) + 1, bool)
    lined[survivor.compress(lines.parted)] = True
    first = np.full(len(lined), count)
    np.minimum.at(first, vertex_of, np.arange(count))
    number = np.where(lined.take(vertex_of), np.arange(count), first.take(vertex_of))
    ones, others = [], []
    for side in range(3):
        following = (side + 1) % 3
        inside = np.flatnonzero((merged[side] == merged[following]) & lined.take(merged[side]))
        ones.append(wedge[side].take(inside))
        others.append(wedge[following].take(inside))
    part = components(count, np.concatenate(ones), np.concatenate(others))
    number = np.where(lined.take(vertex_of), count + part, number)
    names, number = np.unique(number, return_inverse=True)
    vertex = np.zeros(len(names), np.int64)
    vertex[number] = vertex_of
    return number.take(wedge), vertex


def _nearest_corners(points: Floats, faces: Ints, target: Ints, there: Floats, blocks: Blocks) -> Ints:
    """Return, for each wedge, the corner nearest to its place among those that became it, as a slot."""
    squared = _squared(points, faces.ravel(), target.ravel(), there, blocks)
    best = np.full(there.shape[1], np.inf, np.float32)
    np.minimum.at(best, target.ravel(), squared)
    won = np.flatnonzero(squared <= best.take(target.ravel()))[::-1]
    corner = np.zeros(there.shape[1], np.int64)
    corner[target.ravel().take(won)] = won  # of equals the first
    return corner


def _squared(points: Floats, vertices: Ints, target: Ints, there: Floats, blocks: Blocks) -> np.ndarray:
    squared = np.empty(len(vertices), np.float32)

    def measure(part: slice) -> None:
        offset = points.take(vertices[part], axis=1) - there.take(target[part], axis=1)
        squared[part] = (offset * offset).sum(axis=0)

    blocks.map(measure, len(vertices), _BLOCK)
    return squared


def _closest(points: Floats, faces: Ints, target: Ints, there: Floats, corner: Ints, moved: Ints,
             blocks: Blocks) -> tuple[Ints, Floats]:
    """Return the closest faces, among those with a corner in the wedge, of the wedges `moved`, and weights in them."""
    offset = points.take(faces.ravel().take(corner), axis=1) - there
    reach = np.sqrt((offset * offset).sum(axis=0))
    reach[np.setdiff1d(np.arange(len(reach)), moved, assume_unique=True)] = -np.inf

    def near(part: slice) -> tuple[Ints, Ints]:
        """Find the faces that may come closer than the nearest corner."""
        a, b, c = (points.take(row, axis=1) for row in faces[:, part])
        middle = (a + b + c) / 3
        radius = np.sqrt(np.maximum(np.maximum(_square(a - middle), _square(b - middle)), _square(c - middle)))
        found = []
        for side in range(3):
            own = target[side, part]
            new = _square(middle - there.take(own, axis=1)) <= (reach.take(own) * (1 + 1e-9) + radius) ** 2
            new &= reach.take(own) >= 0
            for before in range(side):
                new &= target[before, part] != own
            chosen = np.flatnonzero(new)
            found.append((chosen + part.start, own.take(chosen)))
        return tuple(np.concatenate(rows) for rows in zip(*found, strict=True))

    near_faces, wedges = (np.concatenate(rows) for rows in
                          zip(*blocks.map(near, faces.shape[1], _BLOCK), strict=True))
    used, number = np.unique(near_faces, return_inverse=True)
    frames = triangle_frames(points.T, np.ascontiguousarray(faces.take(used, axis=1).T))
    squared = np.empty(len(wedges))

    def measure(part: slice) -> None:
        squared[part] = closest_in_triangles(frames.take(number[part], axis=1), there.take(wedges[part], axis=1))[1]

    blocks.map(measure, len(wedges), _BLOCK // 4)
    best = np.full(there.shape[1], np.inf)
    np.minimum.at(best, wedges, squared)
    won = np.flatnonzero(squared <= best.take(wedges))[::-1]
    chosen = np.zeros(there.shape[1], np.int64)
    chosen[wedges.take(won)] = won
    chosen = chosen.take(moved)
    face = near_faces.take(chosen)
    place = closest_in_triangles(frames.take(number.take(chosen), axis=1), there.take(moved, axis=1))[0]
    return face, _barycentric(points, faces.take(face, axis=1), place)


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
