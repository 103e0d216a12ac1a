# SPDX-License-Identifier: GPL-3.0-or-later
"""What lines let the engine do: they are simplified along themselves, never across, and never become one."""

from __future__ import annotations

import numpy as np

from .mesh import Bools, Ints


class LineGuard:
    """Holds the vertices of lines to them while edges collapse.

    A vertex on two edges of one line may go along it. Where a line ends, meets another, or changes its kind, the
    vertex is held. All others may go anywhere; onto a line they leave its vertex where it stands.

    Parameters
    ----------
    edges : ndarray, (2, s) int64
        Vertices of the line edges.
    kinds : ndarray, (s,) uint8
    opened : ndarray, (n,) bool
        Vertices at boundaries: a line is held there.

    Attributes
    ----------
    released_at : int or None
        The faces that were left when nothing more could go without crossing lines, and they were given up.
    """

    def __init__(self, edges: Ints, kinds: np.ndarray, opened: Bools) -> None:
        count = len(opened)
        self.released_at: int | None = None
        self._locked = np.zeros(count + 1, bool)
        self._edges = edges
        ends = edges.ravel()
        degree = np.bincount(ends, minlength=count + 1)
        every, some = np.full(count + 1, 255, np.uint8), np.zeros(count + 1, np.uint8)
        np.bitwise_and.at(every, ends, np.tile(kinds, 2))
        np.bitwise_or.at(some, ends, np.tile(kinds, 2))
        passed = (degree == 2) & (every == some) & ~np.append(opened, False)
        self._rank = np.where(degree == 0, 0, np.where(passed, 1, 2)).astype(np.int8)
        self._next = np.full((2, count + 1), -1)
        self._on = np.flatnonzero(self._rank == 1)
        order = np.argsort(ends, kind="stable")
        first = np.searchsorted(ends.take(order), self._on)
        beyond = edges[::-1].ravel()
        self._next[0, self._on] = beyond.take(order.take(first))
        self._next[1, self._on] = beyond.take(order.take(first + 1))

    def lock(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool, where they are, whatever happens."""
        self._locked[:-1] |= vertices
        self._rank[self._locked] = 2
        self._on = self._on.compress(self._rank.take(self._on) == 1)

    def holds(self, one: Ints, other: Ints) -> tuple[Bools, Bools]:
        """Tell which end of each edge must stay where it is; where both must, the edge may not go.

        Parameters
        ----------
        one, other : ndarray, (e,) int64
        """
        first, second = self._rank.take(one), self._rank.take(other)
        holds_one, holds_other = (first > second) | (first == 2), (second > first) | (second == 2)
        both = np.flatnonzero((first > 0) & (second > 0))
        if len(both):
            a, b = one.take(both), other.take(both)
            out = both.compress(~(self._leads(a, b) | self._leads(b, a)))
            holds_one[out] = holds_other[out] = True
        return holds_one, holds_other

    def _leads(self, vertex: Ints, onto: Ints) -> Bools:
        return (self._next[0].take(vertex) == onto) | (self._next[1].take(vertex) == onto)

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses of a batch after which two line edges would be one.

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
        edges = self._edges.compress(np.isin(keys, repeated), axis=1)
        gone = survivor.take(edges) != edges
        dearest = np.where(gone, label.take(edges), -1).max(axis=0)
        return np.unique(dearest[dearest >= 0])

    def follow(self, survivor: Ints) -> None:
        """Take note of a batch that was carried out; arguments as of `clashes`."""
        before, on = self._edges, self._on
        self._edges = survivor.take(before)
        self._edges = self._edges.compress(self._edges[0] != self._edges[1], axis=1)
        if len(on) == 0:
            return
        kept = survivor.take(on)
        ahead = survivor.take(self._next.take(on, axis=1))
        self._next[:, on] = ahead
        gone = np.flatnonzero(kept != on)
        self._on = on.compress(kept == on)
        # of a vertex that went, the neighbour on its other side is now one of the vertex that stays
        onto = kept.take(gone)
        further = np.where(ahead[0].take(gone) == onto, ahead[1].take(gone), ahead[0].take(gone))
        row = (self._next[1].take(onto) == onto).astype(np.int64)
        along = np.flatnonzero(self._rank.take(onto) == 1)
        self._next[row.take(along), onto.take(along)] = further.take(along)

    def release(self, faces_left: int) -> bool:
        """Give the lines up, so that only locked vertices are held; tell whether that changes anything."""
        if self.released_at is not None or not (self._rank[~self._locked] > 0).any():
            return False
        self.released_at = faces_left
        self._rank = np.where(self._locked, 2, 0).astype(np.int8)
        self._edges, self._on = self._edges[:, :0], self._on[:0]
        return True
