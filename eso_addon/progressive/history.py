# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's record read as batches of splits: each collapse checked to be the inverse of a clean split."""

from dataclasses import dataclass

import numpy as np

from ..core.mesh import Bools, Floats, Ints
from .fans import fans_at
from .splits import openings, walk


@dataclass(frozen=True)
class Batch:
    """Splits that are carried out at once: (k,) arrays, in the numbers of the finest mesh.

    Attributes
    ----------
    new, old : ndarray, (k,) int64
        The vertex that appears and the one that it leaves.
    start_face, start_row : ndarray, (k,) int64
        The corner at which the arc starts.
    length : ndarray, (k,) int64
    opened : ndarray, (2, k) int64
        The faces `before` and `after`, -1 where there is none.
    opened_row : ndarray, (2, k) int64
        The row of the new vertex in them.
    third : ndarray, (2, k) int64
        Their third corners.
    opened_wedge : ndarray, (3, 2, k) int64
        Wedges of the new faces.
    """

    new: Ints
    old: Ints
    start_face: Ints
    start_row: Ints
    length: Ints
    opened: Ints
    opened_row: Ints
    third: Ints
    opened_wedge: Ints


class Unwinding:
    """The mesh on its way down, batch by batch.

    A collapse that cannot be taken over is `held`: its vertex stays for good. What the engine did around it afterwards
    rests on it, and is `frozen`, until the engine is run again on what is left.

    Parameters
    ----------
    points : ndarray, (n, 3) float64
    faces : ndarray, (3, m) int64
    wedges : ndarray, (3, m) int64
        Which wedge of its vertex each corner has.
    """

    def __init__(self, points: Floats, faces: Ints, wedges: Ints) -> None:
        self.points = points
        self.faces = faces
        self.wedges = wedges
        self.ids = np.arange(faces.shape[1])
        self.frozen = np.zeros(len(points), bool)
        self.held = np.zeros(len(points), bool)
        self._label = np.full(len(points), -1)
        self._goes = np.arange(len(points))
        self._chosen = np.zeros(len(points), bool)

    def collapse(self, new: Ints, old: Ints) -> tuple[Batch | None, Bools]:
        """Carry out a batch of half-edge collapses; return it, and which of them must wait for the next one.

        They are given in the record's order, in which each follows from those before it. Carried out at once some are
        not the inverse of a clean split: of those that share a face the later ones wait. One that is alone and still
        not clean is held.
        """
        late = np.zeros(len(new), bool)
        at = np.flatnonzero(~(self.frozen.take(new) | self.frozen.take(old)))
        self._freeze(np.delete(new, at))
        while len(at):
            attempt = self._attempt(new.take(at), old.take(at))
            if not attempt.bad.any():
                return attempt.accept(), late
            wait = attempt.later()
            late[at[wait]] = True
            alone = attempt.bad & ~attempt.crowded
            self.held[new[at[alone]]] = True
            self._freeze(new[at[alone]])
            at = at[~wait & ~alone]
        return None, late

    def _attempt(self, new: Ints, old: Ints) -> "_Attempt":
        self._label[new] = np.arange(len(new))
        self._goes[new] = old
        self._chosen[old] = True
        attempt = _Attempt(self, new, old)
        self._label[new] = -1
        self._goes[new] = new
        self._chosen[old] = False
        return attempt

    def _freeze(self, new: Ints) -> None:
        if len(new) == 0:
            return
        self.frozen[new] = True
        gone = np.zeros(len(self.points), bool)
        gone[new] = True
        around = gone.take(self.faces).any(axis=0)
        self.frozen[self.faces[:, around]] = True


class _Attempt:
    """One try of a batch, and what is wrong with it."""

    def __init__(self, mesh: Unwinding, new: Ints, old: Ints) -> None:
        self.mesh, self.new, self.old = mesh, new, old
        count = len(new)
        label = [mesh._label.take(row) for row in mesh.faces]
        self.touched = np.flatnonzero(np.maximum(np.maximum(label[0], label[1]), label[2]) >= 0)
        self.fine = mesh.faces.take(self.touched, axis=1)
        self.label = np.stack([row.take(self.touched) for row in label])
        self.coarse = mesh._goes.take(self.fine)
        a, b, c = self.coarse
        dead = (a == b) | (b == c) | (c == a)
        self._sort_corners(dead, count)
        alive = np.ones(mesh.faces.shape[1], bool)
        alive[self.touched[dead]] = False
        self.kept = np.flatnonzero(alive)
        whole = mesh.faces.copy()
        whole[:, self.touched] = self.coarse
        self.faces = whole.take(self.kept, axis=1)
        self.place = np.cumsum(alive) - 1
        self.fans = fans_at(self.faces, mesh._chosen)
        self.bad = ((self.opened_count > 1).any(axis=0) | ~(self.opened_count > 0).any(axis=0))
        self.bad |= np.isin(old, self.fans.repeated) if len(self.fans.repeated) else False
        self._find_starts()
        self._flat_faces(dead)
        if not self.bad.any():
            self._check_openings()

    def later(self) -> Bools:
        """Find the collapses that must wait: later ones around each that is not clean, and what follows."""
        count = len(self.new)
        own = np.full(len(self.mesh.points), -1)
        own[self.old] = np.arange(count)
        near = np.where(self.label >= 0, self.label, own.take(self.fine))
        one, other = (np.concatenate(parts) for parts in zip(
            *((near[i], self.label[j]) for i in range(3) for j in range(3) if i != j), strict=True))
        met = (one >= 0) & (other >= 0) & (one != other)
        one, other = one[met], other[met]
        first, second = np.minimum(one, other), np.maximum(one, other)
        self.crowded = np.zeros(count, bool)
        self.crowded[one] = True
        wait = np.zeros(count, bool)
        # where both a collapse and an earlier one beside it are there, the later one waits
        wait[second[self.bad.take(one)]] = True
        while True:
            further = second[wait.take(first) & ~wait.take(second)]
            if len(further) == 0:
                return wait
            wait[further] = True

    def _sort_corners(self, dead: Bools, count: int) -> None:
        """Tell corners of new vertices that change vertex from those whose face falls."""
        self.opened = np.full((2, count), -1)
        self.opened_row = np.zeros((2, count), np.int64)
        self.third = np.full((2, count), -1)
        self.opened_count = np.zeros((2, count), np.int64)
        arcs = []
        for row in range(3):
            at = np.flatnonzero(self.label[row] >= 0)
            split = self.label[row].take(at)
            sides = (self.fine[(row + 1) % 3].take(at), self.fine[(row + 2) % 3].take(at))
            for which in range(2):
                falls = np.flatnonzero(sides[which] == self.old.take(split))
                own = split.take(falls)
                self.opened[which, own] = self.touched.take(at.take(falls))
                self.opened_row[which, own] = row
                self.third[which, own] = sides[1 - which].take(falls)
                self.opened_count[which] += np.bincount(own, minlength=count)
            stays = np.flatnonzero(~dead.take(at))
            arcs.append((split.take(stays), self.touched.take(at.take(stays)), np.full(len(stays), row)))
        self.arc_split, self.arc_face, self.arc_row = (np.concatenate(rows) for rows in zip(*arcs, strict=True))
        self.length = np.bincount(self.arc_split, minlength=count)

    def _find_starts(self) -> None:
        """Find where each arc starts, and check that it is one run of corners with clean ends."""
        fans, count, width = self.fans, len(self.new), self.faces.shape[1]
        place_of = np.full(3 * width, -1)
        place_of[fans.slot] = np.arange(len(fans.slot))
        corner = place_of.take(self.arc_row * width + self.place.take(self.arc_face))
        inside = np.full(len(fans.slot) + 1, -1)
        inside[corner] = self.arc_split
        first = np.flatnonzero(inside.take(fans.predecessor.take(corner)) != self.arc_split)
        last = np.flatnonzero(inside.take(fans.successor.take(corner)) != self.arc_split)
        ends = [np.bincount(self.arc_split.take(end), minlength=count) for end in (first, last)]
        self.bad |= (self.length > 0) & ((ends[0] != 1) | (ends[1] != 1))
        self.start = np.full(count, -1)
        final = np.full(count, -1)
        self.start[self.arc_split.take(first)] = corner.take(first)
        final[self.arc_split.take(last)] = corner.take(last)
        self._find_bare()
        there = self.opened >= 0
        good = np.flatnonzero(~self.bad & (self.length > 0))
        start, final = self.start.take(good), final.take(good)
        third = self.mesh._goes.take(self.third.take(good, axis=1))
        wrong = np.where(there[0, good], third[0] != fans.following.take(start), fans.predecessor.take(start) >= 0)
        wrong |= np.where(there[1, good], third[1] != fans.preceding.take(final), fans.successor.take(final) >= 0)
        self.bad[good[wrong]] = True
        good, final = good[~wrong], final[~wrong]
        arcs = walk(fans, self.start.take(good), self._steps(good), there[0, good])
        self.bad[good[arcs.last != final]] = True

    def _steps(self, good: Ints) -> Ints:
        """Return the arcs' lengths, cut where the fan ends sooner: such a split is found bad."""
        return self.length.take(good)

    def _find_bare(self) -> None:
        """Find the corner beside which a lone face opens."""
        bare = np.flatnonzero(self.length == 0)
        if len(bare) == 0:
            return
        fans, mesh = self.fans, self.mesh
        there = self.opened[:, bare] >= 0
        self.bad[bare[there.all(axis=0)]] = True
        index = np.full(len(mesh.points), -1)
        index[self.old[bare]] = np.arange(len(bare))
        own = index.take(fans.vertex)
        third = mesh._goes.take(self.third.take(bare, axis=1))
        for which, (link, ring) in enumerate(((fans.successor, fans.preceding), (fans.predecessor, fans.following))):
            fits = np.flatnonzero((own >= 0) & (link < 0))
            fits = fits[ring.take(fits) == third[which].take(own.take(fits))]
            fits = fits[there[which].take(own.take(fits))]
            self.start[bare[own.take(fits)]] = fits
        self.bad[bare[self.start[bare] < 0]] = True
        self.start[bare[self.bad[bare]]] = 0

    def _flat_faces(self, dead: Bools) -> None:
        """Refuse collapses that make a face without area out of one that had some."""
        alive = np.flatnonzero(~dead)
        doubtful = _no_area(self.mesh.points, self.coarse.take(alive, axis=1))
        if doubtful.any():
            alive = alive[doubtful]
            new = ~_no_area(self.mesh.points, self.fine.take(alive, axis=1))
            hit = self.label.take(alive[new], axis=1)
            self.bad[hit[hit >= 0]] = True

    def _check_openings(self) -> None:
        """Check that a reader finds the third corners of the new faces."""
        fans, there = self.fans, self.opened >= 0
        arcs = walk(fans, self.start, self.length, there[0])
        faces = self.faces.copy()
        faces.ravel()[fans.slot.take(arcs.corner)] = self.new.take(arcs.split)
        found = openings(fans, arcs, self.old, self.start, there, faces, len(self.mesh.points))
        wrong = there & np.where(found.torn, self.mesh._goes.take(self.third) != found.third,
                                 self.third != found.third)
        at, other = found.torn_at, found.partner
        diagonal = found.upper_of(self.third.ravel().take(at) != self.mesh._goes.take(self.third.ravel().take(at)))
        apart = at[(diagonal != diagonal.take(other)) | (other.take(other) != np.arange(len(at)))]
        wrong.ravel()[apart] = True
        self.bad |= wrong.any(axis=0)

    def accept(self) -> Batch:
        """Make the batch the mesh's new state, and return it."""
        mesh, fans, width = self.mesh, self.fans, self.faces.shape[1]
        slot = fans.slot.take(self.start)
        arc_wedge = mesh.wedges.ravel().take(self.arc_row * mesh.faces.shape[1] + self.arc_face)
        opened_wedge = mesh.wedges.take(self.opened, axis=1, mode="clip")
        batch = Batch(self.new, self.old, mesh.ids.take(self.kept.take(slot % width)), slot // width, self.length,
                      np.where(self.opened >= 0, mesh.ids.take(self.opened), -1), self.opened_row,
                      self.third, opened_wedge)
        self._merge_wedges(arc_wedge, opened_wedge)
        mesh.faces, mesh.ids = self.faces, mesh.ids.take(self.kept)
        mesh.wedges = mesh.wedges.take(self.kept, axis=1)
        return batch

    def _merge_wedges(self, arc_wedge: Ints, opened_wedge: Ints) -> None:
        """Give the arcs' corners the wedge of the old vertex that a fallen face joins to theirs."""
        if not self.mesh.wedges.any():
            return
        merged, known = np.zeros(len(arc_wedge), np.int64), np.zeros(len(arc_wedge), bool)
        columns = np.arange(len(self.new))
        for same in (True, False):  # first where the wedges meet, then any
            for which in range(2):
                new_row = self.opened_row[which]
                at_new = opened_wedge[new_row, which, columns].take(self.arc_split)
                at_old = opened_wedge[(new_row + 1 + which) % 3, which, columns].take(self.arc_split)
                fits = ~known & (self.opened[which].take(self.arc_split) >= 0)
                if same:
                    fits &= at_new == arc_wedge
                merged[fits] = at_old[fits]
                known |= fits
        self.mesh.wedges.ravel()[self.arc_row * self.mesh.faces.shape[1] + self.arc_face] = merged


def _no_area(points: Floats, faces: Ints) -> Bools:
    a, b, c = (points.take(row, axis=0).T for row in faces)
    p, q = b - a, c - a
    return ((p[1] * q[2] == p[2] * q[1]) & (p[2] * q[0] == p[0] * q[2]) & (p[0] * q[1] == p[1] * q[0]))
