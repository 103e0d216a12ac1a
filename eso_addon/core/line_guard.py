# SPDX-License-Identifier: GPL-3.0-or-later
"""What lines let the engine do: they are simplified along themselves, and cross or become one only at a high toll."""

from __future__ import annotations

import numpy as np

from .mesh import Bools, Ints


class LineGuard:
    """Holds the vertices of lines to them while edges collapse.

    Vertices on no line may go anywhere, also onto a line; those on lines go along them. What would cross from one line
    to another, or lay two of them together, pays a toll. The lines' quadrics hold them in their place.

    Parameters
    ----------
    edges : ndarray, (2, s) int64
        Vertices of the line edges.
    count : int
        Number of vertices.
    toll : float
        So many times its cost.
    """

    def __init__(self, edges: Ints, count: int, toll: float) -> None:
        self._edges, self._toll = edges, toll
        self._lined = np.zeros(count + 1, bool)
        self._ends = edges[0]
        self._look()

    def _look(self) -> None:
        """Find out which vertices are on lines, and their neighbours there."""
        count = len(self._lined)
        ends = self._edges.ravel()
        self._lined[self._ends] = False
        self._lined[ends] = True
        order = np.sort((ends << 32) | np.arange(len(ends)))
        order &= (1 << 32) - 1
        self._ends = ends.take(order)
        self._keys = np.sort(np.minimum(*self._edges) * count + np.maximum(*self._edges))
        self._neighbors = self._edges[::-1].ravel().take(order)

    def tolls(self, one: Ints, other: Ints) -> np.ndarray:
        """Return what the cost of each edge is multiplied by, (e,) float32."""
        tolls = np.ones(len(one), np.float32)
        lined = np.flatnonzero(self._lined.take(one) & self._lined.take(other))
        tolls[lined[self._offends(one.take(lined), other.take(lined))]] = self._toll
        return tolls

    def _offends(self, one: Ints, other: Ints) -> Bools:
        """Tell the edges between lines that do not lead along them, or whose ends have a line neighbour in common."""
        offends = ~self._joined(one, other)
        along = np.flatnonzero(~offends)
        pair, neighbor = self._around(one.take(along))
        offends[along[pair[self._joined(neighbor, other.take(along.take(pair)))]]] = True
        return offends

    def _joined(self, one: Ints, other: Ints) -> Bools:
        """Tell the pairs of vertices that a line edge joins."""
        if len(self._keys) == 0:
            return np.zeros(len(one), bool)
        keys = np.minimum(one, other) * len(self._lined) + np.maximum(one, other)
        return self._keys.take(np.searchsorted(self._keys, keys).clip(max=len(self._keys) - 1)) == keys

    def _around(self, vertices: Ints) -> tuple[Ints, Ints]:
        """Return the line neighbours of vertices: which of them, and the neighbour."""
        begin = np.searchsorted(self._ends, vertices)
        size = np.searchsorted(self._ends, vertices, side="right") - begin
        pair = np.repeat(np.arange(len(vertices)), size)
        place = np.arange(len(pair)) - np.repeat(np.cumsum(size) - size, size) + np.repeat(begin, size)
        return pair, self._neighbors.take(place)

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses of a batch that lay two lines together without a toll, beside the others of it.

        Parameters
        ----------
        survivor : ndarray, (n + 1,) int64
            What each vertex would become.
        label : ndarray, (n + 1,) int64
            The collapse of each vertex, negative where it is in none.
        """
        start, end = survivor.take(self._edges)
        keys = np.minimum(start, end) * len(survivor) + np.maximum(start, end)
        keys[start == end] = -1
        ranked = np.sort(keys)
        repeated = ranked[1:][(ranked[1:] == ranked[:-1]) & (ranked[1:] >= 0)]
        if len(repeated) == 0:
            return repeated
        ends = np.unique(self._edges.compress(np.isin(keys, repeated), axis=1))
        gone = ends[survivor.take(ends) != ends]
        gone = gone[~self._offends(gone, survivor.take(gone))]
        return np.unique(label.take(gone))

    def follow(self, survivor: Ints) -> None:
        """Take note of a batch that was carried out; arguments as of `clashes`."""
        if len(self._edges[0]) == 0:
            return
        start, end = survivor.take(self._edges)
        keys = np.minimum(start, end) * len(survivor) + np.maximum(start, end)
        keys[start == end] = -1
        keys = np.unique(keys)
        self._edges = np.stack(np.divmod(keys[keys >= 0], len(survivor)))
        self._look()
