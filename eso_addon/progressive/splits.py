# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch of vertex splits: which corners go from each vertex to its new one, and the faces that open between both.

A split at vertex v takes `length` consecutive corners around it, from `start`, to the new vertex u. Where the arc
begins, face (u, v, x) opens (`before`), where it ends, face (v, u, y) (`after`); x and y are the first and last ring
vertices of the arc. At a boundary one of the two may be missing; an arc without corners adds a lone face beside the
start corner. All splits of a batch are carried out at once, in the mesh before the batch.
"""

from dataclasses import dataclass

import numpy as np

from ..core.adjacency import sorting_order
from ..core.mesh import Bools, Ints
from .fans import Fans


@dataclass(frozen=True)
class Arcs:
    """The corners that change vertex: (a,) arrays, and the ends of each split's arc: (k,) arrays.

    Attributes
    ----------
    split, corner : ndarray, (a,) int64
        The split and the corner (as a place in the fans), step by step.
    last : ndarray, (k,) int64
        The last corner of each arc; the start where it has none.
    first_ring, last_ring : ndarray, (k,) int64
        The ring vertices x and y at which `before` and `after` open.
    whole : ndarray, (k,) bool
        False where an arc is longer than its fan.
    """

    split: Ints
    corner: Ints
    last: Ints
    first_ring: Ints
    last_ring: Ints
    whole: Bools

    def settle(self, bare: Ints, before: Bools) -> None:
        """Let both new edges of arcs without corners end at one ring vertex: of a lone face `before`, or `after`."""
        lone = before.take(bare)
        self.first_ring[bare[lone]] = self.last_ring.take(bare[lone])
        self.last_ring[bare[~lone]] = self.first_ring.take(bare[~lone])


def walk(fans: Fans, start: Ints, length: Ints) -> Arcs:
    """Follow each arc from its start; see `Arcs.settle` for arcs without corners."""
    whole = np.ones(len(start), bool)
    last = start.copy()
    chosen = np.flatnonzero(length > 0)
    current = start.take(chosen)
    splits, corners = [chosen], [current]
    step = 1
    while len(chosen):
        further = np.flatnonzero(length.take(chosen) > step)
        chosen, current = chosen.take(further), fans.successor.take(current.take(further))
        if current.min(initial=0) < 0:
            there = np.flatnonzero(current >= 0)
            whole[np.delete(chosen, there)] = False
            chosen, current = chosen.take(there), current.take(there)
        splits.append(chosen)
        corners.append(current)
        last[chosen] = current
        step += 1
    split, corner = np.concatenate(splits), np.concatenate(corners)
    times = np.bincount(corner, minlength=1)
    if times.max() > 1:  # one goes around its fan more than once
        whole[split[times.take(corner) > 1]] = False
    return Arcs(split, corner, last, fans.following.take(start), fans.preceding.take(last), whole)


@dataclass(frozen=True)
class Openings:
    """The third corners of the new faces: (2, k) arrays, row 0 `before`, row 1 `after`.

    Attributes
    ----------
    there : ndarray, (2, k) bool
    third : ndarray, (2, k) int64
        In the mesh after the batch, except where `torn`: there it is the vertex before the batch, or its new one.
    torn : ndarray, (2, k) bool
        The edge at which the face opens is opened from its other end too: a quad opens, cut by one of two diagonals.
    torn_at : ndarray, (t,) int64
        Where `torn` is true in the raveled array.
    partner : ndarray, (t,) int64
        The place in `torn_at` of the opening at the edge's other end.
    """

    there: Bools
    third: Ints
    torn: Bools
    torn_at: Ints
    partner: Ints

    def upper_of(self, diagonal: Bools) -> Bools:
        """Tell which third corners are the new vertices of their splits; for which diagonal, and the other way.

        `diagonal` is (t,) bool: the third corner is the one of the face that runs from the own vertex to the ring's.
        Both openings at an edge have the same.
        """
        return diagonal == (self.torn_at.take(self.partner) >= self.there.shape[1])


def openings(fans: Fans, arcs: Arcs, chosen: Bools, vertex: Ints, start: Ints, there: Bools, faces: Ints) -> Openings:
    """Find the third corners of the new faces.

    Parameters
    ----------
    fans, arcs
        Of the mesh before the batch.
    chosen : ndarray, (n,) bool
        The vertices that split, as `vertex` lists them.
    vertex, start : ndarray, (k,) int64
    there : ndarray, (2, k) bool
    faces : ndarray, (3, m) int64
        With the corners of the arcs moved to the new vertices.
    """
    ring = np.stack((arcs.first_ring, arcs.last_ring))
    torn_at, partner = _torn(chosen, vertex, ring, there)
    torn = np.zeros(there.shape, bool)
    torn.ravel()[torn_at] = True
    # the neighbour of the new face holds the ring vertex as it is after the batch
    bare_before = there[0] & ~there[1] & (arcs.first_ring != fans.following.take(start))
    bare_after = there[1] & ~there[0] & (arcs.last_ring != fans.preceding.take(arcs.last))
    (row, face), (last_row, last_face) = (np.divmod(fans.slot.take(at), max(faces.shape[1], 1))
                                          for at in (start, arcs.last))
    first, last = faces[(row + 1) % 3, face], faces[(last_row + 2) % 3, last_face]
    third = np.stack((np.where(bare_before, last, first), np.where(bare_after, first, last)))
    return Openings(there, np.where(torn, ring, third), torn, torn_at, partner)


def _torn(chosen: Bools, vertex: Ints, ring: Ints, there: Bools) -> tuple[Ints, Ints]:
    """Return the openings whose edge is opened from its other end too, and the place among them of the other one."""
    cuts = np.flatnonzero(there.ravel() & chosen.take(ring.ravel()))
    own, other = vertex.take(cuts % len(vertex)) if len(cuts) else cuts, ring.ravel().take(cuts)
    keys = own * len(chosen) + other
    order = sorting_order(keys)
    ranked = keys.take(order)
    back = other * len(chosen) + own
    place = np.searchsorted(ranked, back)
    torn = np.flatnonzero(ranked.take(place, mode="clip") == back) if len(cuts) else cuts
    number = np.zeros(len(cuts), np.int64)
    number[torn] = np.arange(len(torn))
    return cuts.take(torn), number.take(order.take(place.take(torn)))
