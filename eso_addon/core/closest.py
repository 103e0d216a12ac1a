# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest points on a triangle mesh for whole arrays of points: a tree of boxes walked by groups of points at once."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mesh import morton_order
from .steps import run_to_end

Bools = NDArray[np.bool_]
Floats = NDArray[Any]  # float64, or float32 where only a choice hangs on it
Ints = NDArray[np.int64]

_LEAF = 4  # triangles in a leaf
_FAN = 4  # children of a node
_BEAM = 4  # nodes followed at each level in search of the first bound
_GROUP = 8  # points that walk together, where they lie dense enough
_BLOCK_POINTS = 4096  # points that walk at once
_BLOCK_PAIRS = 4096  # pairs looked at in one step: temporaries stay in the cache, and memory is bounded
_NO_HEIGHT = 1e-18  # the height of a zero-area triangle: no special case, no error that counts, a square in float32
_ROUNDING = 1e-12  # slack of the box tests, relative to the size of the mesh


class ClosestPoints:
    """
    Exact closest points on a triangle mesh.

    Triangles are halved again and again across their longest extent, down to four in a leaf; four nodes have a parent.
    The points are laid along a Morton curve; groups of neighbours drop to a near leaf for a first bound, then walk down
    the tree together.

    Parameters
    ----------
    vertices
        (n, 3) float64, finite.
    faces
        (m, 3) integers, m > 0. Zero-area triangles count as the segments or points that they are.

    Raises
    ------
    ValueError
        If there are no faces.
    """

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        if len(faces) == 0:
            raise ValueError("The mesh has no faces: there is no surface to find closest points on.")
        self._faces = len(faces)
        faces = np.asarray(faces, dtype=np.int64)
        corners = np.asarray(vertices, dtype=np.float64).take(faces, axis=0)
        low, high = corners.min(axis=1), corners.max(axis=1)
        self._center = (low.min(axis=0) + high.max(axis=0)) / 2
        self._size = float((high.max(axis=0) - low.min(axis=0)).max()) or 1.0
        low, high, middle = ((x - self._center) / self._size for x in (low, high, corners.mean(axis=1)))
        order = _tree_order(middle)
        order = np.concatenate([order, np.full(-len(order) % _LEAF, order[-1])])
        # the j-th triangle of leaf i stands in slot j * leaves + i: a leaf's triangles are gathered row by row
        self._face_of_slot = np.ascontiguousarray(order.reshape(-1, _LEAF).T).ravel()
        self._frames = triangle_frames((vertices - self._center) / self._size, faces.take(self._face_of_slot, axis=0))
        self._levels = _box_levels(low.take(order, axis=0), high.take(order, axis=0))

    def query(
        self,
        points: Floats,
        *,
        max_distance: float | None = None,
        hint: Ints | None = None,
        enough: float | None = None,
    ) -> tuple[Floats, Ints, Floats]:
        """
        Return the closest surface point, its face and the squared distance for each point.

        Parameters
        ----------
        points
            (p, 3) float64, finite.
        max_distance
            Surface farther away than this is not looked at.
        hint
            (p,) a face for each point, thought to be near; -1 where nothing is known.
        enough
            A point known to be within this distance gets the surface point that tells so, not the closest: whoever
            seeks the farthest points is soon done with the others.

        Returns
        -------
        closest, face, squared
            (p, 3) float64, (p,) int64 and (p,) float64; NaN, -1 and infinity where nothing lies within `max_distance`.
        """
        steps = self.query_steps(points, max_distance=max_distance, hint=hint, enough=enough)
        return run_to_end(steps)

    def query_steps(
        self,
        points: Floats,
        *,
        max_distance: float | None = None,
        hint: Ints | None = None,
        enough: float | None = None,
    ) -> Generator[None, None, tuple[Floats, Ints, Floats]]:
        """Do what `query` does in steps: yields after each block of points, returns the answers, may be closed."""
        points = (np.asarray(points, dtype=np.float64) - self._center) / self._size
        squared = np.full(len(points), np.inf if max_distance is None else (max_distance / self._size) ** 2)
        slot = np.full(len(points), -1, dtype=np.int64)
        guess = None if hint is None else self._slots(np.asarray(hint, dtype=np.int64))
        bound = -1.0 if enough is None else (enough / self._size) * (enough / self._size)
        for rows in _groups(points, self._faces):
            walk = _Walk(self._levels, self._frames, points.take(rows, axis=0), squared.take(rows))
            walk.start(None if guess is None else guess.take(rows))
            walk.run(bound)
            squared[rows], slot[rows] = walk.squared, walk.slot
            yield
        return self._finish(points, slot)

    def _slots(self, faces: Ints) -> Ints:
        """Return the slots of faces; -1 stays."""
        slot = np.empty(self._faces, dtype=np.int64)
        slot[self._face_of_slot] = np.arange(len(self._face_of_slot))
        return np.where(faces < 0, -1, slot.take(np.maximum(faces, 0)))

    def _finish(self, points: Floats, slot: Ints) -> tuple[Floats, Ints, Floats]:
        """Return the answers in the caller's units from the found slots."""
        closest = np.empty_like(points)
        for part in _parts(len(points), _BLOCK_POINTS):
            frame = self._frames.take(np.maximum(slot[part], 0), axis=1)
            closest[part] = closest_in_triangles(frame, points[part].T)[0].T
        squared = np.einsum("ij,ij->i", points - closest, points - closest) * self._size**2
        closest *= self._size
        closest += self._center
        missed = slot < 0
        closest[missed], squared[missed] = np.nan, np.inf
        return closest, np.where(missed, -1, self._face_of_slot.take(np.maximum(slot, 0))), squared


class _Walk:
    """One block of groups of points on its way through the tree: `squared` and `slot` (width, groups) get better."""

    def __init__(self, levels: list[Floats], frames: Floats, points: Floats, squared: Floats) -> None:
        """Take the tree, (width, groups, 3) points and their (width, groups) bounds."""
        self.levels, self.frames = levels, frames
        self.leaf_frames = frames.reshape(len(frames), _LEAF, -1)
        self.points = np.ascontiguousarray(points.transpose(2, 0, 1))
        self.squared = squared
        self.slot = np.full(squared.shape, -1, dtype=np.int64)
        low, high = self.points.min(axis=1), self.points.max(axis=1)
        self.center, self.half = (low + high) / 2, (high - low) / 2
        self.slack = _ROUNDING * (1 + np.abs(self.points).max())

    def start(self, guess: Ints | None) -> None:
        """Find first bounds: from the guessed slots, or from a leaf near each group's centre."""
        if guess is not None:
            known = guess >= 0
            squared = squared_distances(self.frames.take(np.maximum(guess, 0), axis=1), self.points)
            better = known & (squared <= self.squared)
            self.squared = np.where(better, squared, self.squared)
            self.slot = np.where(better, guess, -1)
            if known.all():
                return
        leaf = np.broadcast_to(self._near_leaves(), self.squared.shape).ravel()
        self._test_leaves(np.arange(len(leaf)), leaf)

    def _near_leaves(self) -> Ints:
        """Return a leaf near each group's centre, found by following the few most promising nodes of each level."""
        groups = np.arange(self.squared.shape[1])
        node = np.zeros((1, len(groups)), dtype=np.int64)
        for boxes in reversed(self.levels):
            node = np.minimum(node, boxes.shape[2] - 1)  # empty nodes may be among the followed
            child = boxes.take(node, axis=2)
            away = np.abs(child[:3] - self.center[:, None, None])
            gap = np.maximum(away - child[3:], 0)
            # among boxes around the centre the one with the nearer middle is more promising
            order = (gap * gap).sum(axis=0) + 1e-3 * (away * away).sum(axis=0)
            order = order.reshape(-1, len(groups))
            node = (_FAN * node + np.arange(_FAN)[:, None, None]).reshape(-1, len(groups))
            if len(order) > _BEAM:
                best = np.ascontiguousarray(order.T).argpartition(_BEAM, axis=1)[:, :_BEAM].T
                node, order = node[best, groups], order[best, groups]
        return np.minimum(node[order.argmin(axis=0), groups], self.leaf_frames.shape[2] - 1)

    def run(self, enough: float) -> None:
        """Walk down from the root with every group that has a point not yet within a squared distance."""
        groups = np.flatnonzero(self.squared.max(axis=0) > enough)
        self._descend(len(self.levels) - 1, groups, np.zeros(len(groups), dtype=np.int64))

    def _descend(self, level: int, group: Ints, node: Ints) -> None:
        """Go on with the children of the (group, node) pairs whose boxes come within the group's bound."""
        for part in _parts(len(group), _BLOCK_PAIRS):
            pair_group, pair_node = group[part], node[part]
            boxes = self.levels[level].take(pair_node, axis=2)
            bound = (np.sqrt(self.squared.max(axis=0)) + self.slack) ** 2
            half = boxes[3:] + self.half.take(pair_group, axis=1)[:, None]
            near = _squared_gaps(boxes[:3], half, self.center.take(pair_group, axis=1)[:, None])
            pair, child = np.nonzero((near <= bound.take(pair_group)).T)
            next_group = pair_group.take(pair)
            if level:
                self._descend(level - 1, next_group, _FAN * pair_node.take(pair) + child)
            else:
                self._meet_leaves(next_group, _FAN * pair_node.take(pair) + child, boxes[:, child, pair])

    def _meet_leaves(self, group: Ints, leaf: Ints, boxes: Floats) -> None:
        """Test the points of each group whose own bound reaches the leaf's box."""
        for part in _parts(len(group), _BLOCK_PAIRS):
            pair_group = group[part]
            near = _squared_gaps(boxes[:3, None, part], boxes[3:, None, part], self.points.take(pair_group, axis=2))
            bound = (np.sqrt(self.squared.take(pair_group, axis=1)) + self.slack) ** 2
            pair, member = np.nonzero((near <= bound).T)
            self._test_leaves(member * self.squared.shape[1] + pair_group.take(pair), leaf[part].take(pair))

    def _test_leaves(self, point: Ints, leaf: Ints) -> None:
        """Test points against the triangles of leaves and keep what is nearer."""
        points, best, slot = self.points.reshape(3, -1), self.squared.reshape(-1), self.slot.reshape(-1)
        for part in _parts(len(point), _BLOCK_PAIRS):
            pair_point, pair_leaf = point[part], leaf[part]
            frames = self.leaf_frames.take(pair_leaf, axis=2)
            squared = squared_distances(frames, points.take(pair_point, axis=1)[:, None])
            least = squared.min(axis=0)
            np.minimum.at(best, pair_point, least)
            won = np.flatnonzero(least <= best.take(pair_point))
            corner = squared[:, won].argmin(axis=0)
            slot[pair_point.take(won)] = corner * self.leaf_frames.shape[2] + pair_leaf.take(won)


def _squared_gaps(center: Floats, half: Floats, points: Floats) -> Floats:
    """Return the squared distances of (3, ...) points to boxes."""
    gap = np.abs(center - points)
    gap -= half
    np.maximum(gap, 0, out=gap)
    gap *= gap
    total = gap[0]
    total += gap[1]
    total += gap[2]
    return total


def _groups(points: Floats, faces: int) -> Iterator[Ints]:
    """Yield blocks of (width, groups) point indices: neighbours go together, one by one where they lie far apart."""
    if len(points) == 0:
        return
    order = morton_order(points.clip(-1, 1))  # far points must not make the cells coarse
    width = _GROUP if 2 * len(points) >= faces else 1
    order = np.concatenate([order, np.full(-len(order) % width, order[-1])]).reshape(-1, width)
    blocks = [order]
    if width > 1:
        members = points.take(order, axis=0)
        extent = (members.max(axis=1) - members.min(axis=1)).max(axis=1)
        wide = extent > 3 * np.median(extent)
        blocks = [order[~wide], order[wide].reshape(-1, 1)]
    for block in blocks:
        for part in _parts(len(block), _BLOCK_POINTS // block.shape[1]):
            yield np.ascontiguousarray(block[part].T)


def _parts(count: int, size: int) -> Iterator[slice]:
    """Yield slices of at most `size`."""
    return (slice(start, start + size) for start in range(0, count, size))


def _tree_order(points: Floats) -> Ints:
    """Return the order of (n, 3) points in a tree that halves each node's points across its longest axis."""
    count = len(points)
    index_bits = max(count - 1, 1).bit_length()
    half = _LEAF
    while 2 * half < count:
        half *= 2
    columns = np.ascontiguousarray(points.T)
    order = np.arange(count)
    while half >= _LEAF:
        starts = np.arange(0, count, 2 * half)
        low, high = np.minimum.reduceat(columns, starts, axis=1), np.maximum.reduceat(columns, starts, axis=1)
        axis = (high - low).argmax(axis=0)
        node = np.arange(count) // (2 * half)
        bits = 63 - index_bits - len(starts).bit_length()
        key = ((columns.take(axis.take(node) * count + np.arange(count)) + 1) * 2.0 ** (bits - 1)).astype(np.int64)
        key += node << bits
        key <<= index_bits
        key |= np.arange(count)
        key.sort()
        key &= (1 << index_bits) - 1
        order, columns = order.take(key), columns.take(key, axis=1)
        half //= 2
    return order


def _box_levels(low: Floats, high: Floats) -> list[Floats]:
    """Return (6, _FAN, nodes) centres and half sizes of the children of each node, from the leaves up to the root."""
    low, high = low.reshape(-1, _LEAF, 3).min(axis=1), high.reshape(-1, _LEAF, 3).max(axis=1)
    levels: list[Floats] = []
    while len(low) > 1 or not levels:
        short = -len(low) % _FAN
        center = np.concatenate([(low + high) / 2, np.full((short, 3), np.inf)])  # infinitely far away: no child
        half = np.concatenate([(high - low) / 2, np.zeros((short, 3))])
        levels.append(np.concatenate([center, half], axis=1).reshape(-1, _FAN, 6).transpose(2, 1, 0).copy())
        parents = np.arange(0, len(low), _FAN)
        low, high = np.minimum.reduceat(low, parents), np.maximum.reduceat(high, parents)
    return levels


def triangle_frames(vertices: Floats, faces: Ints) -> Floats:
    """Return (15, m) rows that describe each triangle in a frame of its own.

    The origin is the foot of the height on the longest edge, x runs along that edge, y along the height, z along the
    normal: rows 0 to 11 hold (axis, offset) of x, y, z, rows 12 to 14 the edge's length on the negative and the
    positive side of the foot and the height. Slivers and zero-area triangles keep orthonormal axes.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    """
    frames = np.empty((15, len(faces)))
    columns = np.ascontiguousarray(vertices.T)
    for part in _parts(len(faces), _BLOCK_POINTS):
        _write_frames(columns.take(faces[part].T, axis=1), frames[:, part])
    return frames


def _write_frames(corners: Floats, frames: Floats) -> None:
    """Write the rows of `triangle_frames` for (3 axes, 3 corners, k) corners."""
    edges = corners[:, [1, 2, 0]] - corners
    first = (edges * edges).sum(axis=0).argmax(axis=0)
    a, b, c = (corners[:, (first + turn) % 3, np.arange(len(first))] for turn in range(3))
    along, length = _unit(b - a, np.array([[1.0], [0.0], [0.0]]))
    across = c - a
    foot = _dot(across, along).clip(0, length)
    across -= foot * along
    # a height lost in rounding may point anywhere across the edge: its length is what keeps it exact
    spare = _cross(along, np.eye(3).take(np.abs(along).argmin(axis=0), axis=1))
    across, height = _unit(across, spare)
    across -= _dot(across, along) * along
    across, _ = _unit(np.where(_dot(across, across) < 0.5, spare, across), spare)
    origin = a + foot * along
    for row, axis in enumerate((along, across, _cross(along, across))):
        frames[4 * row : 4 * row + 3] = axis
        frames[4 * row + 3] = -_dot(axis, origin)
    frames[12], frames[13], frames[14] = foot, length - foot, np.maximum(height, _NO_HEIGHT)


def _unit(vectors: Floats, spare: Floats) -> tuple[Floats, Floats]:
    """Return (3, k) unit vectors, `spare` in place of zeros, and the lengths."""
    length = np.sqrt(_dot(vectors, vectors))
    zero = length == 0
    return np.where(zero, spare, vectors / np.where(zero, 1, length)), length


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the dot products of (3, k) columns."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of (3, k) columns."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _offsets(frame: Floats, points: Floats) -> tuple[Floats, ...]:
    """
    Return how far points stick out of their triangles in the triangle's frame.

    The height cuts a triangle into two right triangles, and the closest point of a point lies in the half on its own
    side: so a point is mirrored onto one half, pushed up to the edge and in over the slope. No branches.

    Returns
    -------
    above, below, out, past, side, slope_x, slope_y
        Height over the plane, depth under the longest edge (at most 0), distance out over the slope (at least 0),
        distance past the slope's ends, 1 on the positive side and -1 on the other, and the slope's outward normal.
    """
    x, y, z = points[0], points[1], points[2]
    along = frame[0] * x + frame[1] * y + frame[2] * z + frame[3]
    across = frame[4] * x + frame[5] * y + frame[6] * z + frame[7]
    above = frame[8] * x + frame[9] * y + frame[10] * z + frame[11]
    side = np.copysign(1.0, along)
    length_left, slope_left, flat_left = _slope(frame[12], frame[14])
    length_right, slope_right, flat_right = _slope(frame[13], frame[14])
    base = (frame[12] + frame[13]) / 2 + (frame[13] - frame[12]) / 2 * side
    slope_x = (slope_left + slope_right) / 2 + (slope_right - slope_left) / 2 * side
    slope_y = (flat_left + flat_right) / 2 + (flat_right - flat_left) / 2 * side
    length = (length_left + length_right) / 4 + (length_right - length_left) / 4 * side
    below = np.minimum(across, 0)
    across = across - below
    along = along * side - base
    out = np.maximum(along * slope_x + across * slope_y, 0)
    past = across * slope_x - along * slope_y - length
    past = np.copysign(np.maximum(np.abs(past) - length, 0), past)
    return above, below, out, past, side, slope_x, slope_y


def _slope(base: Floats, height: Floats) -> tuple[Floats, Ints, Floats]:
    """Return the hypotenuse of right triangles and its outward unit normal."""
    length = np.sqrt(base * base + height * height)
    return length, height / length, base / length


def squared_distances(frame: Floats, points: Floats) -> Floats:
    """Return squared distances of (3, ...) points to triangles given by (15, ...) frames."""
    above, below, out, past, *_ = _offsets(frame, points)
    return above * above + below * below + out * out + past * past


def closest_in_triangles(frame: Floats, points: Floats) -> tuple[Floats, Floats, Bools]:
    """Return the (3, k) points of triangles closest to (3, k) points, squared distances, and what lies off the side.

    The last, (k,) bool, tells whether the closest point is on the rim, so that another triangle may be nearer.
    """
    above, below, out, past, side, slope_x, slope_y = _offsets(frame, points)
    along = (out * slope_x - past * slope_y) * side
    across = out * slope_y + past * slope_x + below
    closest = points - along * frame[0:3] - across * frame[4:7] - above * frame[8:11]
    return closest, above * above + below * below + out * out + past * past, (out > 0) | (below < 0)
