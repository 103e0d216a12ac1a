# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of a simplified mesh beside those of the original: samples along these, each with the nearest edge of those."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]
Ints = NDArray[np.int64]

_GAUSS = 0.5 - 0.5 / np.sqrt(3)  # where two samples of an edge integrate cubics along it


class Curves:
    """Samples of the original's lines, and the simplified mesh's edges that each may be nearest to.

    Parameters
    ----------
    points : (n, 3) float64
        The original's vertices.
    lines : (2, s) int64
        The edges of it that are lines.
    vertex_map : (n,) int64
        The simplified vertex that each has become, below zero if none.

    Attributes
    ----------
    edges : (2, e) int64
        What the lines have become.
    exact : (3, k) float64
        The samples.
    lengths : (k,) float64
        How much of a line each stands for.
    """

    def __init__(self, points: Floats, lines: Ints, vertex_map: Ints) -> None:
        ends = vertex_map.take(lines)
        there = (ends >= 0).all(axis=0)
        lines, ends = lines.compress(there, axis=1), ends.compress(there, axis=1)
        self.edges = np.unique(np.sort(ends.compress(ends[0] != ends[1], axis=1), axis=0), axis=1)
        # an edge's samples may be nearest to what leaves either of the vertices that its ends have become
        leaving, around = np.argsort(self.edges.ravel(), kind="stable"), np.bincount(self.edges.ravel())
        around = np.concatenate((around, np.zeros(int(ends.max(initial=0)) + 1 - len(around), np.int64)))
        counts = around.take(ends)
        known = counts.any(axis=0)
        lines, ends, counts = (rows.compress(known, axis=1) for rows in (lines, ends, counts))
        self._counts = np.tile(counts.sum(axis=0), 2)
        flat = counts.T.ravel()
        first = np.cumsum(around).take(ends.T.ravel()) - flat
        place = np.repeat(first - np.cumsum(flat) + flat, flat) + np.arange(flat.sum())
        self._candidates = np.tile(leaving.take(place) % max(self.edges.shape[1], 1), 2)
        a, b = points.take(lines[0], axis=0).T, points.take(lines[1], axis=0).T
        self.exact = np.concatenate((a + _GAUSS * (b - a), b + _GAUSS * (a - b)), axis=1)
        self.lengths = np.tile(np.sqrt(((b - a) ** 2).sum(axis=0)) / 2, 2)

    def weights(self, area: float, faces: int) -> Floats:
        """Return what the samples weigh, as parts of a surface of this area: a line is a strip as wide as a face."""
        return self.lengths * np.sqrt(area / faces) / max(area, 1e-300)

    def look(self, vertices: Floats) -> tuple[Ints, Floats]:
        """Return the nearest edge of each sample, (k,), and the weights of its two ends there, (2, k)."""
        columns = np.ascontiguousarray(vertices.T)
        start = columns.take(self.edges[0], axis=1)
        along = columns.take(self.edges[1], axis=1) - start
        square = np.maximum((along * along).sum(axis=0), 1e-300)
        sample = np.repeat(np.arange(len(self._counts)), self._counts)
        offset = self.exact.take(sample, axis=1) - start.take(self._candidates, axis=1)
        toward = along.take(self._candidates, axis=1)
        share = ((offset * toward).sum(axis=0) / square.take(self._candidates)).clip(0, 1)
        offset -= share * toward
        squared = (offset * offset).sum(axis=0)
        least = np.minimum.reduceat(squared, np.cumsum(self._counts) - self._counts)
        won = np.flatnonzero(squared == np.repeat(least, self._counts))[::-1]  # of equals the first
        edge, second = np.zeros(len(self._counts), np.int64), np.zeros(len(self._counts))
        edge[sample.take(won)], second[sample.take(won)] = self._candidates.take(won), share.take(won)
        return edge, np.stack((1 - second, second))
