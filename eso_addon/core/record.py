# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of one run of the engine: every collapse in order, from which any level is a prefix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Bools, Floats, Ints


@dataclass(frozen=True)
class CollapseRecord:
    """What one run of the engine did to a mesh.

    Attributes
    ----------
    removed, kept : ndarray, (c,) int64
        The vertex that goes and the vertex that stays, for each collapse.
    position : ndarray, (c, 3) float64
        Where the kept vertex stands after it.
    faces_left : ndarray, (c,) int64
        Triangles left after it.
    cost : ndarray, (c,) float32
        Its cost, in the engine's units.
    batch_starts : ndarray, (b,) int64
        Where each batch of collapses without a common vertex starts.
    faces_before : int
        Triangles before the first collapse.
    stays : ndarray, (c,) bool
        Whether the kept vertex stood there before (half-edge collapse).
    """

    removed: Ints
    kept: Ints
    position: Floats
    faces_left: Ints
    cost: np.ndarray
    batch_starts: Ints
    faces_before: int
    stays: Bools

    def __len__(self) -> int:
        return len(self.removed)

    def length_for(self, faces: int) -> int:
        """Return how many collapses leave at most so many triangles: all of them where none does."""
        if faces >= self.faces_before:
            return 0
        return min(int(np.searchsorted(-self.faces_left, -faces)) + 1, len(self))

    def left(self, length: int) -> int:
        """Return how many triangles so many collapses leave."""
        return int(self.faces_left[length - 1]) if length else self.faces_before

    def first(self, length: int) -> CollapseRecord:
        """Return the record of the first collapses alone."""
        starts = self.batch_starts[self.batch_starts < length]
        return CollapseRecord(self.removed[:length], self.kept[:length], self.position[:length],
                              self.faces_left[:length], self.cost[:length], starts, self.faces_before,
                              self.stays[:length])

    def survivors(self, vertex_count: int, length: int) -> Ints:
        """Return the vertex that each vertex has become after `length` collapses: (n,) int64."""
        parent = np.arange(vertex_count)
        parent[self.removed[:length]] = self.kept[:length]
        while True:  # each round halves the way to the survivor
            further = parent.take(parent)
            if np.array_equal(further, parent):
                return parent
            parent = further

    def level(self, vertices: Floats, faces: Ints, length: int) -> tuple[Floats, Ints, Ints, Ints]:
        """Apply the first `length` collapses to the mesh that was recorded.

        Parameters
        ----------
        vertices : ndarray, (n, 3) float64
        faces : ndarray, (m, 3) int64
        length : int

        Returns
        -------
        points : ndarray, (n, 3) float64
            Positions after the collapses, of all vertices; only survivors' mean something.
        corners : ndarray, (k, 3) int64
            The faces left, in the input's numbers of vertices.
        face_map : ndarray, (k,) int64
            The input face that each comes from.
        survivor : ndarray, (n,) int64
        """
        survivor = self.survivors(len(vertices), length)
        points = vertices.copy()
        points[self.kept[:length]] = self.position[:length]  # of several moves of one vertex the last one holds
        a, b, c = (survivor.take(column) for column in faces.T)
        face_map = np.flatnonzero((a != b) & (b != c) & (c != a))
        return points, np.stack([column.take(face_map) for column in (a, b, c)], axis=1), face_map, survivor
