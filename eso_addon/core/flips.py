# SPDX-License-Identifier: GPL-3.0-or-later
"""Flips edges of a simplified mesh where its surface then lies nearer to samples of the original."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .adjacency import sorting_order
from .closest import squared_distances, triangle_frames
from .normals import face_area_vectors, lengths

Bools = NDArray[np.bool_]
Floats = NDArray[Any]  # float64, or float32 where only a choice hangs on it
Ints = NDArray[np.int64]

_TURN = 0.5  # least cosine between the new faces' normals and the one that both old faces have together
_SHAPE = 0.02  # least area over squared edges of the new faces,
_THINNER = 0.5  # or this part of what the thinner of the old ones has
_TILT = 0.05  # what a turn against the original's normal weighs, times the edge, beside a distance
_ROOM = 0.7  # of the worst squared distance: no sample gets farther than this, unless one of its pair is already
_BLOCK = 8192


class _Pairs(NamedTuple):
    """Edges that may be flipped: (e,) the two faces, and the corners of the new ones, (e, 3), as slots 3 * face + n."""

    one: Ints
    other: Ints
    first: Ints
    second: Ints

    def take(self, chosen: Ints) -> _Pairs:
        """Return some of the pairs."""
        return _Pairs(*(row.take(chosen, axis=0) for row in self))


def flip_edges(
    vertices: Floats,
    faces: Ints,
    points: Floats,
    normals: Floats,
    weights: Floats,
    face: Ints,
    squared: Floats,
    *,
    bound: Bools | None = None,
    group: Ints | None = None,
    among: Bools | None = None,
) -> tuple[Ints, Ints]:
    """Flip edges that bring a surface nearer to samples of its original (Hoppe et al. 1993, section 4.2: edge swap).

    Parameters
    ----------
    vertices, faces : (k, 3) float64 and (m, 3) int64
    points, normals : (3, s) float32 and (3, s) float64
        Samples of the original; normals are zero where there is none.
    weights, face, squared : (s,)
        What each sample weighs, the face that it lies nearest to, and its squared distance.
    bound : (k,) bool, optional
        An edge between two such vertices stays.
    group : (m,) int64, optional
        An edge between faces of different groups stays.
    among : (m,) bool, optional
        An edge with none of these faces stays.

    Returns
    -------
    corner, face : (m, 3) and (s,) int64
        For each corner of the new faces the old corner that it was, as 3 * face + number; the new nearest faces.
    """
    corner, face = np.arange(faces.size).reshape(faces.shape), face.copy()
    pairs = _flippable(vertices, faces, bound, group, among)
    if len(pairs.one) == 0:
        return corner, face
    order = sorting_order(face)
    ends = np.concatenate([[0], np.cumsum(np.bincount(face, minlength=len(faces)))])
    gain, nearer = np.zeros(len(pairs.one)), []
    own = face_area_vectors(vertices, faces)
    own /= np.maximum(lengths(own), 1e-300)[:, None]
    roof = _ROOM * float(squared.max())
    for part, pair, sample in _samples_of(pairs, order, ends):
        chosen = pairs.take(part)
        new = [_New.of(vertices, faces.ravel().take(slots)) for slots in (chosen.first, chosen.second)]
        gain[part], second = _gains(chosen, new, own, points, normals, weights, face, squared, pair, sample, roof)
        nearer.append((part.take(pair), sample, second))
    won = _matching(pairs, gain, faces, len(vertices))
    corner[pairs.one[won]], corner[pairs.other[won]] = pairs.first[won], pairs.second[won]
    flipped = np.zeros(len(gain), bool)
    flipped[won] = True
    pair, sample, second = (np.concatenate(rows) for rows in zip(*nearer, strict=True))
    rows = np.flatnonzero(flipped.take(pair))
    pair = pair.take(rows)
    face[sample.take(rows)] = np.where(second.take(rows), pairs.other.take(pair), pairs.one.take(pair))
    return corner, face


def _flippable(vertices: Floats, faces: Ints, bound: Bools | None, group: Ints | None, among: Bools | None) -> _Pairs:
    """Return the edges whose flip keeps a manifold mesh of well-shaped faces that look the same way."""
    count = len(vertices)
    begin, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(begin, end) * count + np.maximum(begin, end)
    order = sorting_order(keys)
    keys = keys.take(order)
    same = np.concatenate([[False], keys[1:] == keys[:-1], [False]])
    # exactly two sides, wound against each other
    first = np.flatnonzero(same[1:-1] & ~same[:-2] & ~same[2:])
    one, other = order.take(first), order.take(first + 1)
    good = begin.take(one) == end.take(other)
    if bound is not None:
        good &= ~(bound.take(begin.take(one)) & bound.take(end.take(one)))
    if group is not None:
        good &= group.take(one // 3) == group.take(other // 3)
    if among is not None:
        good &= among.take(one // 3) | among.take(other // 3)
    one, other = one[good], other[good]
    left, right = _before(one), _before(other)
    a, b = begin.take(left), begin.take(right)
    key = np.minimum(a, b) * count + np.maximum(a, b)
    there = keys.take(np.searchsorted(keys, key).clip(max=len(keys) - 1)) == key
    free = np.flatnonzero(~there & (a != b))
    one, other, left, right = (row.take(free) for row in (one, other, left, right))
    # the edge from u to v, faces (u, v, a) and (v, u, b), becomes the one from a to b
    pairs = _Pairs(one // 3, other // 3, np.stack([one, right, left], 1), np.stack([right, other, left], 1))
    return pairs.take(np.flatnonzero(_sound(vertices, faces, pairs)))


def _before(slots: Ints) -> Ints:
    """Return the corner before each in its face."""
    return np.where(slots % 3 == 0, slots + 2, slots - 1)


def _sound(vertices: Floats, faces: Ints, pairs: _Pairs) -> Bools:
    """Tell the flips after which both faces look where the old ones did and are not much thinner."""
    old = [_New.of(vertices, faces.take(face, axis=0)) for face in (pairs.one, pairs.other)]
    new = [_New.of(vertices, faces.ravel().take(slots)) for slots in (pairs.first, pairs.second)]
    both: Floats = old[0].vector + old[1].vector
    least = _TURN * lengths(both)
    thin = np.minimum(_SHAPE, _THINNER * np.minimum(old[0].shape, old[1].shape))
    sound = np.ones(len(thin), bool)
    for side in new:
        sound &= np.einsum("ij,ij->i", side.vector, both) > least * lengths(side.vector)
        sound &= side.shape > thin
    return sound


class _New(NamedTuple):
    """Triangles of (e, 3) corners: positions, area vectors, areas over squared edges."""

    corners: Floats
    vector: Floats
    shape: Floats

    @classmethod
    def of(cls, vertices: Floats, corners: Ints) -> _New:
        places = vertices.take(corners, axis=0)
        one, other = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
        third = other - one
        vector = np.cross(one, other) / 2
        squares = (one * one + other * other + third * third).sum(axis=1)
        return cls(places, vector, lengths(vector) / np.maximum(squares, 1e-300))


def _samples_of(pairs: _Pairs, order: Ints, ends: Ints) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Yield blocks of pairs that have samples: which, and for each sample of their faces its pair and number."""
    first, second = np.diff(ends).take(pairs.one), np.diff(ends).take(pairs.other)
    counts = first + second
    total = np.cumsum(counts)
    block = (total - 1) // _BLOCK
    for part in np.split(np.arange(len(total)), np.flatnonzero(np.diff(block)) + 1):
        part = part[counts[part] > 0]
        if len(part) == 0:
            continue
        size = counts[part]
        pair = np.repeat(np.arange(len(part)), size)
        place = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
        beyond = place - first.take(part).take(pair)
        start = np.where(beyond < 0, ends.take(pairs.one.take(part)).take(pair) + place,
                         ends.take(pairs.other.take(part)).take(pair) + beyond)
        yield part, pair, order.take(start)


def _gains(pairs: _Pairs, new: list[_New], own: Floats, points: Floats, normals: Floats, weights: Floats, face: Ints,
           squared: Floats, pair: Ints, sample: Ints, roof: float) -> tuple[Floats, Bools]:
    """Return how much nearer each flip brings its samples, and whether a sample is then nearer to the second face."""
    local, before = points.take(sample, axis=1), squared.take(sample)
    after = [_distances(side, pair, local) for side in new]
    second = after[1] < after[0]
    least = np.where(second, after[1], after[0])
    weight = weights.take(sample)
    count = len(pairs.one)
    gain = np.bincount(pair, weight * (before - least), minlength=count)
    toward = normals.take(sample, axis=1)
    units = [side.vector / np.maximum(lengths(side.vector), 1e-300)[:, None] for side in new]
    now = _cosines(toward, own.take(face.take(sample), axis=0))
    one, other = (_cosines(toward, unit.take(pair, axis=0)) for unit in units)
    turn = np.bincount(pair, weight * (np.where(second, other, one) - now), minlength=count)
    along = new[0].corners[:, 1] - new[0].corners[:, 2]
    gain += _TILT * np.einsum("ij,ij->i", along, along) * turn
    starts = np.flatnonzero(np.diff(pair, prepend=-1))
    far = np.maximum.reduceat(least, starts) > np.maximum(np.maximum.reduceat(before, starts), roof)
    return np.where(far, 0, gain), second


def _distances(faces: _New, pair: Ints, points: Floats) -> Floats:
    flat = faces.corners.reshape(-1, 3)
    frames = triangle_frames(flat, np.arange(len(flat)).reshape(-1, 3)).astype(np.float32)
    return squared_distances(frames.take(pair, axis=1), points)


def _cosines(columns: Floats, rows: Floats) -> Floats:
    return columns[0] * rows[:, 0] + columns[1] * rows[:, 1] + columns[2] * rows[:, 2]


def _matching(pairs: _Pairs, gain: Floats, faces: Ints, count: int) -> Ints:
    """Return the flips that gain most at both their faces, and no two that make the same edge."""
    chosen = np.flatnonzero(gain > 0)
    # ties go to the edge that comes first
    chosen = chosen.take(np.lexsort((chosen, -gain.take(chosen))))
    rank, best = np.arange(len(chosen)), np.full(len(faces), len(chosen))
    one, other = pairs.one.take(chosen), pairs.other.take(chosen)
    np.minimum.at(best, one, rank)
    np.minimum.at(best, other, rank)
    won = chosen.take(np.flatnonzero((best.take(one) == rank) & (best.take(other) == rank)))
    ends = faces.ravel().take(pairs.first.take(won, axis=0))[:, 1:]
    return won.take(np.unique(ends.min(axis=1) * count + ends.max(axis=1), return_index=True)[1])
