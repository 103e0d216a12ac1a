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
        count = len(points)
        self.points = points
        self.faces = faces.copy()
        self.wedges = wedges
        self.ids = np.arange(faces.shape[1])
        self.frozen = np.zeros(count, bool)
        self.held = np.zeros(count, bool)
        # the vertex of dead faces is one more than there are
        self.nowhere = count
        self._dead = 0
        self._role = np.full(count + 1, -1)  # of a vertex that goes the number of its collapse k, of its goal -2 - k
        self._goes = np.arange(count + 1)

    def collapse(self, new: Ints, old: Ints) -> tuple[Batch | None, Bools]:
        """Carry out a batch of half-edge collapses; return it, and which of them must wait for the next one.

        They are given in the record's order, in which each follows from those before it. Carried out at once some are
        not the inverse of a clean split: of those that share a face the later ones wait. One that is alone and still
        not clean is held.
        """
        late = np.zeros(len(new), bool)
        at = np.flatnonzero(~(self.frozen.take(new) | self.frozen.take(old)))
        self._freeze(np.delete(new, at))
        near = self._around(np.concatenate((new.take(at), old.take(at))))
        faces = self.faces.take(near, axis=1)
        while len(at):
            attempt = self._attempt(near, faces, new.take(at), old.take(at))
            if not attempt.bad.any():
                batch = attempt.accept()
                if 4 * self._dead > self.faces.shape[1]:
                    self.pack()
                return batch, late
            wait = attempt.later()
            late[at[wait]] = True
            alone = attempt.bad & ~attempt.crowded
            self.held[new[at[alone]]] = True
            self._freeze(new[at[alone]])
            at = at[~wait & ~alone]
        return None, late

    def pack(self) -> None:
        """Leave dead faces out."""
        alive = np.flatnonzero(self.faces[0] != self.nowhere)
        self.faces, self.wedges = self.faces.take(alive, axis=1), self.wedges.take(alive, axis=1)
        self.ids, self._dead = self.ids.take(alive), 0

    def change(self, face: Ints, corners: Ints, dead: int) -> None:
        """Give faces other corners, so many of them none."""
        self.faces[:, face] = corners
        self._dead += dead

    def _attempt(self, near: Ints, faces: Ints, new: Ints, old: Ints) -> "_Attempt":
        self._role[new] = np.arange(len(new))
        self._role[old] = -2 - np.arange(len(new))
        self._goes[new] = old
        attempt = _Attempt(self, near, faces, new, old)
        self._role[new] = self._role[old] = -1
        self._goes[new] = new
        return attempt

    def _around(self, vertices: Ints) -> Ints:
        """Return the faces at some vertices."""
        there = np.zeros(self.nowhere + 1, bool)
        there[vertices] = True
        one, two, three = (there.take(row) for row in self.faces)
        return np.flatnonzero(one | two | three)

    def _freeze(self, new: Ints) -> None:
        if len(new):
            self.frozen[new] = True
            self.frozen[self.faces.take(self._around(new), axis=1)] = True


class _Attempt:
    """One try of a batch, and what is wrong with it.

    Parameters
    ----------
    mesh : Unwinding
    near : ndarray, (m,) int64
        The faces around the batch.
    faces : ndarray, (3, m) int64
        Their corners.
    new, old : ndarray, (k,) int64
    """

    def __init__(self, mesh: Unwinding, near: Ints, faces: Ints, new: Ints, old: Ints) -> None:
        self.mesh, self.near, self.new, self.old = mesh, near, new, old
        role = [mesh._role.take(row) for row in faces]
        self.touched = np.flatnonzero(np.maximum(np.maximum(role[0], role[1]), role[2]) >= 0)
        self.fine = faces.take(self.touched, axis=1)
        self.role = np.stack([row.take(self.touched) for row in role])
        self.coarse = mesh._goes.take(self.fine)
        a, b, c = self.coarse
        self.dead = (a == b) | (b == c) | (c == a)
        self._sort_corners()
        self.faces = faces.copy()
        for row, corners in zip(self.faces, self.coarse, strict=True):
            row[self.touched] = np.where(self.dead, mesh.nowhere, corners)
        self.fans = fans_at(self.faces, mesh._role < -1)
        self.bad = (self.opened_count > 1).any(axis=0) | ~(self.opened_count > 0).any(axis=0)
        self.bad |= np.isin(old, self.fans.repeated) if len(self.fans.repeated) else False
        self._find_starts()
        if not self.bad.any():
            self._flat_faces()
        if not self.bad.any():
            self._check_openings()

    def later(self) -> Bools:
        """Find the collapses that must wait: later ones around each that is not clean, and what follows."""
        count = len(self.new)
        near = np.where(self.role < -1, -2 - self.role, self.role)
        most = near.max(axis=0)
        mixed = np.flatnonzero(((near != most) & (near >= 0)).any(axis=0))
        near, role = near.take(mixed, axis=1), self.role.take(mixed, axis=1)
        one, other = (np.concatenate(parts) for parts in zip(
            *((near[i], role[j]) for i in range(3) for j in range(3) if i != j), strict=True))
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

    def _sort_corners(self) -> None:
        """Tell corners of new vertices that change vertex from those whose face falls."""
        count = len(self.new)
        self.opened = np.full((2, count), -1)
        self.opened_row = np.zeros((2, count), np.int64)
        self.third = np.full((2, count), -1)
        self.opened_count = np.zeros((2, count), np.int64)
        arcs = []
        for row in range(3):
            at = np.flatnonzero(self.role[row] >= 0)
            split = self.role[row].take(at)
            sides = (self.fine[(row + 1) % 3].take(at), self.fine[(row + 2) % 3].take(at))
            for which in range(2):
                falls = np.flatnonzero(sides[which] == self.old.take(split))
                own = split.take(falls)
                self.opened[which, own] = self.touched.take(at.take(falls))
                self.opened_row[which, own] = row
                self.third[which, own] = sides[1 - which].take(falls)
                self.opened_count[which] += np.bincount(own, minlength=count)
            stays = np.flatnonzero(~self.dead.take(at))
            arcs.append((split.take(stays), self.touched.take(at.take(stays)), np.full(len(stays), row)))
        self.arc_split, self.arc_face, self.arc_row = (np.concatenate(rows) for rows in zip(*arcs, strict=True))
        self.length = np.bincount(self.arc_split, minlength=count)

    def _find_starts(self) -> None:
        """Find where each arc starts, and check that it is one run of corners with clean ends."""
        fans, count, width = self.fans, len(self.new), self.faces.shape[1]
        place_of = np.empty(3 * width, np.int64)
        place_of[fans.slot] = np.arange(len(fans.slot))
        corner = place_of.take(self.arc_row * width + self.arc_face)
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
        arcs = walk(fans, self.start.take(good), self.length.take(good))
        self.bad[good[(arcs.last != final) | ~arcs.whole]] = True

    def _find_bare(self) -> None:
        """Find the corner beside which a lone face opens."""
        bare = np.flatnonzero(self.length == 0)
        if len(bare) == 0:
            return
        fans, mesh = self.fans, self.mesh
        there = self.opened[:, bare] >= 0
        self.bad[bare[there.all(axis=0)]] = True
        index = np.full(mesh.nowhere, -1)
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

    def _flat_faces(self) -> None:
        """Refuse collapses that make a face without area out of one that had some."""
        alive = np.flatnonzero(~self.dead)
        doubtful = _no_area(self.mesh.points, self.coarse.take(alive, axis=1))
        if doubtful.any():
            alive = alive[doubtful]
            new = ~_no_area(self.mesh.points, self.fine.take(alive, axis=1))
            hit = self.role.take(alive[new], axis=1)
            self.bad[hit[hit >= 0]] = True

    def _check_openings(self) -> None:
        """Check that a reader finds the third corners of the new faces."""
        fans, goes, there = self.fans, self.mesh._goes, self.opened >= 0
        arcs = walk(fans, self.start, self.length)
        arcs.settle(np.flatnonzero(self.length == 0), there[0])
        self.faces.ravel()[fans.slot.take(arcs.corner)] = self.new.take(arcs.split)
        found = openings(fans, arcs, self.mesh._role < -1, self.old, self.start, there, self.faces)
        wrong = there & np.where(found.torn, goes.take(self.third) != found.third, self.third != found.third)
        at, other = found.torn_at, found.partner
        diagonal = found.upper_of(self.third.ravel().take(at) != goes.take(self.third.ravel().take(at)))
        apart = at[(diagonal != diagonal.take(other)) | (other.take(other) != np.arange(len(at)))]
        wrong.ravel()[apart] = True
        self.bad |= wrong.any(axis=0)

    def accept(self) -> Batch:
        """Make the batch the mesh's new state, and return it."""
        mesh, near, width = self.mesh, self.near, self.faces.shape[1]
        row, face = np.divmod(self.fans.slot.take(self.start), width)
        opened = near.take(self.opened, mode="clip")
        opened_wedge = mesh.wedges.take(opened, axis=1)
        batch = Batch(self.new, self.old, mesh.ids.take(near.take(face)), row, self.length,
                      np.where(self.opened >= 0, mesh.ids.take(opened), -1), self.opened_row, self.third, opened_wedge)
        self._merge_wedges(opened_wedge)
        mesh.change(near.take(self.touched), np.where(self.dead, mesh.nowhere, self.coarse), int(self.dead.sum()))
        return batch

    def _merge_wedges(self, opened_wedge: Ints) -> None:
        """Give the arcs' corners the wedge of the old vertex that a fallen face joins to theirs."""
        if not self.mesh.wedges.any():
            return
        slot = self.arc_row * self.mesh.faces.shape[1] + self.near.take(self.arc_face)
        arc_wedge = self.mesh.wedges.ravel().take(slot)
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
        self.mesh.wedges.ravel()[slot] = merged


def _no_area(points: Floats, faces: Ints) -> Bools:
    a, b, c = (points.take(row, axis=0).T for row in faces)
    p, q = b - a, c - a
    return ((p[1] * q[2] == p[2] * q[1]) & (p[2] * q[0] == p[0] * q[2]) & (p[0] * q[1] == p[1] * q[0]))
