# SPDX-License-Identifier: GPL-3.0-or-later
"""Which edges the feature method collapses, and in which order (Chen and Nishita, sections 3.3 to 4.2)."""

from __future__ import annotations

import numpy as np

from .blocks import Blocks
from .features import sharp_edges, with_virtual_edge
from .mesh import Bools, Floats, Ints, MeshError
from .options import Options
from .prepare import Prepared
from .quadrics import cross

# the engine's faces a block: its arrays stay in the second cache
_BLOCK = 8192
# edges nearer to flat than this differ by rounding only: all of them leave together
_FLAT = 1e-6
# a sharp line keeps a vertex where it turns by more than 60 degrees
_STRAIGHT = 0.5


def guide_for(mesh: Prepared, options: Options, lines: Ints | None = None) -> FeatureGuide:
    """Make the guide of a mesh: boundaries, edges beyond an angle, those that the options name and `lines` are sharp.

    Parameters
    ----------
    mesh : Prepared
    options : Options
    lines : ndarray, (2, s) int64, optional
        Edges of the engine's mesh.
    """
    pairs = None
    if options.sharp is not None:
        pairs = np.asarray(options.sharp)
        if pairs.size == 0:
            pairs = np.zeros((0, 2), np.int64)
        if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
            raise MeshError(f"sharp must be an (s, 2) array of vertices, not {pairs.shape} {pairs.dtype}")
        if pairs.size and (pairs.min() < 0 or pairs.max() >= len(mesh.vertex)):
            raise MeshError(f"sharp names a vertex that is not there ({len(mesh.vertex)} vertices)")
        pairs = mesh.vertex.take(pairs)
    if lines is not None:
        pairs = lines.T if pairs is None else np.concatenate((pairs, lines.T))
    sharp = sharp_edges(mesh.points.T, mesh.faces.T, marked=pairs, angle=options.sharp_angle)
    return FeatureGuide(sharp, options.epsilon, mesh.points.shape[1])


class FeatureGuide:
    """Weighs an edge by the virtual edge across it, and holds the ends of sharp edges and of base edges.

    Parameters
    ----------
    sharp : ndarray, (s, 2) int64
        Sharp edges. A vertex of exactly two may go along them, where they are not significant.
    epsilon : float, optional
        Edges whose virtual edge weighs less are base edges; without it there are none.
    count : int
        Number of vertices.
    """

    def __init__(self, sharp: Ints, epsilon: float | None, count: int) -> None:
        self._sharp = np.ascontiguousarray(sharp.T)
        self._epsilon = epsilon
        self._free = np.ones(count + 1, bool)  # may go anywhere
        self._along = np.full((2, count + 1), -1)  # where a vertex on a sharp line may go
        self._flat = np.zeros(count + 1)
        self._held = np.zeros(count + 1, bool)  # from then on, mostly by base edges
        self._held[-1] = True
        self._normals = np.zeros((count + 1, 4))  # the last column unused: rows of 32 bytes are gathered fastest
        self._number = np.zeros(count + 1, np.int64)

    def hold(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool, whatever happens."""
        self._held[:-1] |= vertices

    def weigh(self, points: Floats, faces: Ints, survivor: Ints, blocks: Blocks) -> np.ndarray:
        """Return what each side costs: one less its weight, infinite where neither end may go.

        Parameters
        ----------
        points : ndarray, (n + 1, 4) float64
            Rows; the last is the vertex of dead faces.
        faces : ndarray, (3, m) int64
        survivor : ndarray, (n + 1,) int64
            What each vertex has become in the last batch.
        blocks : Blocks

        Returns
        -------
        ndarray, (3, m) float32
        """
        self._measure(points, faces, blocks)
        normals = self._normals
        costs, featured = self._virtual_weights(normals, faces, blocks)
        self._free[:] = True
        self._free[-1] = False
        self._follow_lines(points, normals, survivor)
        if len(featured):
            self._held[with_virtual_edge(faces, len(points), featured)] = True
        self._free[self._held] = False
        self._along[:, self._held] = -1
        if not self._free[:-1].all():
            self._hold(costs, faces, blocks)
        return costs

    def swaps(self, one: Ints, other: Ints) -> Bools:
        """Tell where the first vertex goes: where the second may not, or the first has the flatter star (4.2.3)."""
        first, second = self._may_go(one, other), self._may_go(other, one)
        return first & (~second | (self._flat.take(one) > self._flat.take(other)))

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses after which two sharp edges would be one."""
        start, end = survivor.take(self._sharp)
        left = np.flatnonzero(start != end)
        start, end = start.take(left), end.take(left)
        keys = np.minimum(start, end) * len(survivor) + np.maximum(start, end)
        order = np.argsort(keys, kind="stable")
        same = np.flatnonzero(np.diff(keys.take(order)) == 0)
        if len(same) == 0:
            return same
        edges = left.take(np.stack((order.take(same), order.take(same + 1))))
        dearest = label.take(self._sharp.take(edges, axis=1)).max(axis=(0, 1))
        return np.unique(dearest[dearest >= 0])

    def _measure(self, points: Floats, faces: Ints, blocks: Blocks) -> None:
        """Renew the mean normals and how flat the stars are; see `features.mean_normals`."""
        used = None
        if 8 * faces.shape[1] < len(points):  # few are left: only they
            used = np.unique(faces)
            self._number[used] = np.arange(len(used))
            points, faces = points.take(used, axis=0), self._number.take(faces)
        vectors = np.empty((4, faces.shape[1]))

        def measure(part: slice) -> None:
            corner = faces[:, part]
            first = points.take(corner[0], axis=0)
            one, two = (points.take(corner[side], axis=0) - first for side in (1, 2))
            x, y, z = cross(one.T, two.T)
            vectors[0, part], vectors[1, part], vectors[2, part] = x, y, z
            vectors[3, part] = np.sqrt(x * x + y * y + z * z)

        def gather(axis: slice) -> Floats:
            values = vectors[axis.start]
            total = np.zeros(len(points))
            for corner in faces:
                total += np.bincount(corner, values, len(points))
            return total

        blocks.map(measure, faces.shape[1], _BLOCK)
        x, y, z, areas = blocks.map(gather, 4, 1)
        np.maximum(areas, 1e-300, out=areas)
        rows = self._normals if used is None else np.zeros((len(used), 4))
        for axis, total in enumerate((x, y, z)):
            np.divide(total, areas, out=rows[:, axis])
        flat = np.einsum("ij,ij->i", rows, rows)
        if used is None:
            self._flat = flat
        else:
            self._normals[used], self._flat[used] = rows, flat

    def _virtual_weights(self, normals: Floats, faces: Ints, blocks: Blocks) -> tuple[np.ndarray, Ints]:
        """Return the costs by ESOD weights, and the sides whose weight makes them a feature."""
        count = faces.shape[1]
        costs = np.empty(faces.shape, np.float32)
        least = -np.inf if self._epsilon is None else self._epsilon

        def weigh(part: slice) -> list[Ints]:
            rows = [normals.take(corner, axis=0).T for corner in faces[:, part]]
            held = [self._held.take(corner) for corner in faces[:, part]]
            featured = []
            for side in range(3):
                a, b = rows[side], rows[(side + 1) % 3]
                weight = a[0] * b[0]
                weight += a[1] * b[1]
                weight += a[2] * b[2]
                if self._epsilon is not None:
                    face = np.flatnonzero(weight < least)
                    face = face[~(held[side].take(face) & held[(side + 1) % 3].take(face))]  # nothing new
                    featured.append(face + (side * count + part.start))
                np.subtract(1, weight, out=weight)
                np.maximum(weight, _FLAT, out=costs[side, part], casting="same_kind")
            return featured

        found = [slots for block in blocks.map(weigh, count, _BLOCK) for slots in block]
        slots = np.concatenate(found) if found else np.zeros(0, np.int64)
        return costs, slots

    def _follow_lines(self, points: Floats, normals: Floats, survivor: Ints) -> None:
        """Renew the sharp edges after a batch: who may go along them, and how straight they are there (4.1)."""
        sharp = survivor.take(self._sharp)
        self._sharp = sharp = sharp[:, sharp[0] != sharp[1]]
        if sharp.shape[1] == 0:
            return
        ends, beyond = sharp.ravel(), sharp[::-1].ravel()
        order = np.argsort(ends, kind="stable")
        starts = np.flatnonzero(np.diff(ends.take(order), prepend=-1))
        passed = starts[np.diff(starts, append=len(ends)) == 2]
        vertex = ends.take(order.take(passed))
        self._free[ends] = False
        self._along[:, ends] = -1
        back, ahead = beyond.take(order.take(passed)), beyond.take(order.take(passed + 1))
        here = points.take(vertex, axis=0)
        arriving, leaving = here - points.take(back, axis=0), points.take(ahead, axis=0) - here
        straight = np.einsum("ij,ij->i", arriving, leaving) / np.maximum(
            np.sqrt(np.einsum("ij,ij->i", arriving, arriving) * np.einsum("ij,ij->i", leaving, leaving)), 1e-300)
        own = normals.take(vertex, axis=0)
        weight = np.minimum(np.einsum("ij,ij->i", own, normals.take(back, axis=0)),
                            np.einsum("ij,ij->i", own, normals.take(ahead, axis=0)))
        goes = straight >= _STRAIGHT
        if self._epsilon is not None:
            goes &= weight >= self._epsilon
        self._flat[vertex] = straight
        vertex = vertex[goes]
        self._along[0, vertex], self._along[1, vertex] = back[goes], ahead[goes]

    def _hold(self, costs: np.ndarray, faces: Ints, blocks: Blocks) -> None:
        """Make the edges dear where neither end may go."""
        lines = self._sharp.shape[1] > 0

        def hold(part: slice) -> None:
            corner = faces[:, part]
            free = [self._free.take(row) for row in corner]
            for side in range(3):
                following = (side + 1) % 3
                held = np.flatnonzero(~(free[side] | free[following]))
                if lines:
                    start, end = corner[side].take(held), corner[following].take(held)
                    held = held[~(self._along_line(start, end) | self._along_line(end, start))]
                costs[side, part][held] = np.inf

        blocks.map(hold, faces.shape[1], _BLOCK)

    def _along_line(self, vertex: Ints, onto: Ints) -> Bools:
        return (self._along[0].take(vertex) == onto) | (self._along[1].take(vertex) == onto)

    def _may_go(self, vertex: Ints, onto: Ints) -> Bools:
        return self._free.take(vertex) | self._along_line(vertex, onto)
