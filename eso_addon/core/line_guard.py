# SPDX-License-Identifier: GPL-3.0-or-later
"""What lines let the engine do: they are simplified along themselves, and cross or become one only at a high toll."""

from __future__ import annotations

import numpy as np

from .mesh import Bools, Ints

_FREE, _ON, _HELD = 0, 1, 2


class LineGuard:
    """Holds the vertices of lines to them while edges collapse.

    Vertices on no line may go anywhere; onto a line they leave its vertex where it stands. A vertex on two edges of one
    line goes along it. Where a line ends, meets another, or changes its kind, what goes along it leaves the vertex
    where it stands. What would cross from one line to another, or lay two of them together, pays a toll.

    Parameters
    ----------
    edges : ndarray, (2, s) int64
        Vertices of the line edges.
    kinds : ndarray, (s,) uint8
    opened : ndarray, (n,) bool
        Vertices at boundaries: a line is held there.
    toll : float
        So many times its cost.
    """

    def __init__(self, edges: Ints, kinds: np.ndarray, opened: Bools, toll: float) -> None:
        self._edges, self._kinds, self._toll = edges, kinds, toll
        self._opened = np.append(opened, False)
        self._locked = np.zeros(len(opened) + 1, bool)
        self._rank = np.zeros(len(opened) + 1, np.int8)
        self._ends = edges[0]
        self._look()

    def lock(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool, where they are, whatever happens."""
        self._locked[:-1] |= vertices
        self._rank[self._locked] = _HELD

    def _look(self) -> None:
        """Find out what each vertex is to the lines."""
        count = len(self._rank)
        ends = self._edges.ravel()
        self._rank[self._ends] = _FREE
        self._rank[ends] = _HELD
        order = np.sort((ends << 32) | np.arange(len(ends)))
        order &= (1 << 32) - 1
        sorted_ends = ends.take(order)
        first = np.flatnonzero(np.diff(sorted_ends, prepend=-1))
        passed = first[np.diff(first, append=len(ends)) == 2]
        kinds = np.tile(self._kinds, 2)
        vertex = sorted_ends.take(passed)
        passed = passed[(kinds.take(order.take(passed)) == kinds.take(order.take(passed + 1)))
                        & ~self._opened.take(vertex)]
        self._rank[sorted_ends.take(passed)] = _ON
        self._rank[self._locked] = _HELD
        self._keys = np.sort(np.minimum(*self._edges) * count + np.maximum(*self._edges))
        self._neighbors = self._edges[::-1].ravel().take(order)
        self._ends = sorted_ends

    def holds(self, one: Ints, other: Ints) -> tuple[Bools, Bools]:
        """Tell which end of each edge must stay where it is; where both must, the edge may not go.

        Parameters
        ----------
        one, other : ndarray, (e,) int64
        """
        first, second = self._rank.take(one), self._rank.take(other)
        holds_one, holds_other = first > second, second > first
        holds_one |= self._locked.take(one)
        holds_other |= self._locked.take(other)
        return holds_one, holds_other

    def tolls(self, one: Ints, other: Ints) -> np.ndarray:
        """Return what the cost of each edge is multiplied by, (e,) float32."""
        tolls = np.ones(len(one), np.float32)
        lined = np.flatnonzero((self._rank.take(one) > _FREE) & (self._rank.take(other) > _FREE))
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
        keys = np.minimum(one, other) * len(self._rank) + np.maximum(one, other)
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
        keys, number = np.unique(keys, return_inverse=True)
        kinds = np.zeros(len(keys), np.uint8)
        np.bitwise_or.at(kinds, number, self._kinds)
        there = keys >= 0
        self._kinds, self._edges = kinds[there], np.stack(np.divmod(keys[there], len(survivor)))
        self._look()
