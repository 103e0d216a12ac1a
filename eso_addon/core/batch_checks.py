# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks a batch over: which collapses would turn a face too far or change the topology.

Each is tested in the state that the cheaper ones of its batch leave; what stood beside a rejected one is tested again.
"""

import numpy as np

from .engine_state import BLOCK, NONE, Batch, State, Touched
from .mesh import Bools, Ints
from .quadrics import Components, cross

# no face may shrink to less than this part of its area: flat meshes would fill with faces without any
_SLIVER = 1e-3
# below it single precision rounds more and more
_LEAST = np.finfo(np.float32).tiny
# of each corner that stays, its collapse and the next vertex; of those at a boundary, also the previous one
_Links = tuple[Ints, Ints, Ints, Ints]


def check_batch(state: State, batch: Batch) -> None:
    """Mark the collapses that would turn a face over or change the topology."""
    count = len(batch.one)

    def test(part: slice) -> tuple[Touched, Ints, Ints, _Links]:
        touched = _touched(state, part)
        falling = touched.gone.take(np.flatnonzero(touched.gone != NONE))
        return touched, falling, _flips(state, touched), _links(state, batch, touched)

    tested = state.blocks.map(test, state.faces.shape[1], BLOCK)
    batch.touched = [touched for touched, _, _, _ in tested]
    batch.falling = np.bincount(np.concatenate([falling for _, falling, _, _ in tested]), minlength=count)
    rejected = np.zeros(count, bool)
    for _, _, flipped, _ in tested:
        rejected[flipped] = True
    if state.rules.guard:
        rejected |= _broken(state, batch, [links for _, _, _, links in tested], np.arange(count))
    if state.guide is not None:
        rejected[state.guide.clashes(state.survivor, state.label)] = True
    while rejected.any():
        rejected = _reject(state, batch, rejected)
        if state.guide is not None and not rejected.any():
            rejected[state.guide.clashes(state.survivor, state.label)] = True


def _touched(state: State, part: slice) -> Touched:
    corner = state.faces[:, part]
    labels = [state.label.take(row) for row in corner]
    face = np.flatnonzero(np.maximum(np.maximum(labels[0], labels[1]), labels[2]) >= 0)
    touched = np.empty((2, 3, len(face)), np.int64)
    for side in range(3):
        corner[side].take(face, out=touched[0, side], mode="clip")  # buffered where it may raise
        labels[side].take(face, out=touched[1, side], mode="clip")
    label = touched[1]
    gone = _removers(label)
    collapses = (label >= 0).view(np.int8)
    mixed = np.flatnonzero(collapses[0] + collapses[1] + collapses[2] - (gone != NONE) > 1)
    return Touched(face + part.start, touched[0], label, gone, mixed)


def _removers(label: Ints) -> Ints:
    """Return the collapse that has two corners of each face, else none."""
    first, second, third = label
    by_first, by_second = (first == second) | (first == third), second == third
    # sums of products: a choice by a mask costs three times as much
    return NONE - (NONE - first) * by_first - (NONE - second) * (by_second & ~by_first)


def _flips(state: State, touched: Touched) -> Ints:
    """Return the collapses that turn a face too far, each in the state that the cheaper ones leave."""
    corner, label = touched.corner, touched.label
    old = _normals(state.before, corner)
    flipped = np.flatnonzero(turned(state, old, _normals(state.after, corner)) & (touched.gone == NONE))
    alone = label.take(flipped, axis=1).max(axis=0, initial=-1)
    found = [alone.compress(alone >= 0)]  # a face that has not changed is no one's, whatever rounding says
    # faces of several collapses pass through states in between
    own_labels = label.take(touched.mixed, axis=1)
    last = np.minimum(own_labels.max(axis=0, initial=-1), touched.gone.take(touched.mixed)).view(np.uint64)
    for side in range(3):
        own = own_labels[side]
        between = np.flatnonzero(own.view(np.uint64) < last)
        face, own = touched.mixed.take(between), own.take(between)
        moved = label.take(face, axis=1).view(np.uint64) <= own.view(np.uint64)
        new = _normals(state.rows, corner.take(face, axis=1) + moved * len(state.points))
        found.append(own[turned(state, [axis.take(face) for axis in old], new)])
    return np.concatenate(found)


def turned(state: State, old: Components, new: Components) -> Bools:
    """Tell the faces that turn or shrink too far, by the components of their normals before and after.

    Those so small that the squares of their areas vanish are as good as none.
    """
    turn = old[0] * new[0] + old[1] * new[1] + old[2] * new[2]
    was, becomes = (side[0] * side[0] + side[1] * side[1] + side[2] * side[2] for side in (old, new))
    least = state.rules.flip
    needed = np.maximum(np.float32(least * abs(least)) * becomes, np.float32(_SLIVER**2) * was)
    needed *= was
    return (turn * np.abs(turn) <= needed) & (needed > _LEAST)


def _normals(rows: np.ndarray, corner: Ints) -> tuple:
    base = rows.take(corner[0], axis=0)
    return cross((rows.take(corner[1], axis=0) - base).T, (rows.take(corner[2], axis=0) - base).T)


def _links(state: State, batch: Batch, touched: Touched, among: Bools | None = None) -> _Links:
    """Return the ring of each collapse when its turn comes: faces fallen and vertices gone before are not there.

    `among`, (c + 1,) bool, False and then whether to look at each collapse, leaves out the others.
    """
    pairs, ends = [], []
    for side in range(3):
        own = touched.label[side]
        turn = own.view(np.uint64) < touched.gone.view(np.uint64)
        if among is not None:
            turn &= among.take(own + 1, mode="clip")
        chosen = np.flatnonzero(turn)
        own = own.take(chosen)
        pairs.append((own, _at_turn(state, touched, (side + 1) % 3, chosen, own)))
        if state.open:
            chosen = chosen.compress(batch.at_boundary.take(own))
            own = touched.label[side].take(chosen)
            ends.append((own, _at_turn(state, touched, (side + 2) % 3, chosen, own)))
        else:
            ends.append((own[:0], own[:0]))
    own, following = (np.concatenate(rows) for rows in zip(*pairs, strict=True))
    open_own, preceding = (np.concatenate(rows) for rows in zip(*ends, strict=True))
    return own, following, open_own, preceding


def _at_turn(state: State, touched: Touched, side: int, chosen: Ints, own: Ints) -> Ints:
    """Return the corners of the chosen faces at one side, as the collapses before their own leave them."""
    corner = touched.corner[side].take(chosen)
    before = np.flatnonzero(touched.label[side].take(chosen).view(np.uint64) < own.view(np.uint64))
    corner[before] = state.survivor.take(corner.take(before))
    return corner


def _broken(state: State, batch: Batch, links: list[_Links], which: Ints) -> Bools:
    """Tell which of these collapses break the link condition: around the merged vertex a ring vertex must come once."""
    count = len(which)
    number = np.zeros(len(batch.one), np.int64)
    number[which] = np.arange(count)
    one, other, falling = batch.one.take(which), batch.other.take(which), batch.falling.take(which)
    at_boundary = batch.at_boundary.take(which)
    faces_left = np.bincount(number.take(np.concatenate([own for own, _, _, _ in links])), minlength=count)
    both = state.boundary.take(one) & state.boundary.take(other)
    broken = (faces_left < np.where(at_boundary, 1, 3)) | ((falling > 1) & both)
    broken[number.take(_rivals(state, links))] = True
    if state.open:
        # open fans must stay open and apart: the last vertex of each is none of the others
        rings = [keys for own, following, open_own, preceding in links for keys in (
            ((own << 32) | following).compress(batch.at_boundary.take(own)), (open_own << 32) | preceding)]
        distinct = np.bincount(number.take(np.unique(np.concatenate(rings)) >> 32), minlength=count)
        fans = state.fans.take(one) + state.fans.take(other) - (falling == 1)
        broken |= at_boundary & (distinct != faces_left + fans)
    return broken


def _rivals(state: State, links: list[_Links]) -> Ints:
    """Return the collapses with a ring vertex that comes twice: two writers of one place are rare, and looked at."""
    suspect = np.zeros(len(state.owner), bool)

    def places(block: int) -> tuple[Ints, Ints]:
        own, following, _, _ = links[block]
        return following * 4 + (own & 3), np.arange(len(own)) * len(links) + block

    def claim(block: slice) -> None:
        place, numbers = places(block.start)
        state.owner[place] = numbers

    def doubt(block: slice) -> None:
        place, numbers = places(block.start)
        suspect[place.compress(state.owner.take(place) != numbers)] = True

    def collect(block: slice) -> Ints:
        own, following, _, _ = links[block.start]
        return ((own << 32) | following).compress(suspect.take(places(block.start)[0]))

    state.blocks.map(claim, len(links), 1)
    state.blocks.map(doubt, len(links), 1)
    return _repeated(np.concatenate(state.blocks.map(collect, len(links), 1))) >> 32


def _repeated(keys: Ints) -> Ints:
    keys = np.sort(keys)
    return keys[1:][keys[1:] == keys[:-1]]


def withdraw(state: State, batch: Batch, out: Bools) -> None:
    """Take collapses out of the batch, as if they had not been chosen."""
    batch.bad |= out
    for end in (batch.one[out], batch.other[out]):
        state.after[end] = state.before[end]
        state.label[end] = ~end
        state.survivor[end] = end


def _reject(state: State, batch: Batch, rejected: Bools) -> Bools:
    """Take collapses out of the batch; return those that fail without them."""
    withdraw(state, batch, rejected)
    outcast = np.append(False, rejected)

    def renew(block: slice) -> tuple[Ints, Ints]:
        touched = batch.touched[block.start]
        face = touched.mixed.take(_among(outcast, [row.take(touched.mixed) for row in touched.label]))
        batch.unsure[_after_another(touched.label.take(face, axis=1), outcast)] = True
        label = state.label.take(touched.corner.take(face, axis=1))
        touched.label[:, face] = label
        touched.gone[face] = _removers(label)
        return label, _flips(state, touched.take(face))

    renewed = state.blocks.map(renew, len(batch.touched), 1)
    failed = np.zeros(len(rejected), bool)
    failed[np.concatenate([flipped for _, flipped in renewed])] = True
    beside = np.zeros(len(rejected) + 1, bool)
    for label, _ in renewed:
        beside[label[label >= 0] + 1] = True
    again = np.flatnonzero(beside[1:])
    if state.rules.guard and len(again):
        stars = state.blocks.map(lambda block: batch.touched[block.start].take(
            _among(beside, batch.touched[block.start].label)), len(batch.touched), 1)
        links = _links(state, batch, _joined(stars), beside)
        failed[again.compress(_broken(state, batch, [links], again))] = True
    return failed & ~batch.bad


def _after_another(label: Ints, outcast: Bools) -> Ints:
    """Return the outcasts that were tested after another outcast at the same face."""
    out = np.where(outcast.take(label + 1, mode="clip"), label, NONE)
    return out[(out > out.min(axis=0)) & (out < NONE)]


def _among(some: Bools, label: Ints | list[Ints]) -> Ints:
    """Return the faces with a corner in some of the collapses, (c + 1,) bool after a False."""
    one, two, three = (some.take(row + 1, mode="clip") for row in label)
    return np.flatnonzero(one | two | three)


def _joined(parts: list[Touched]) -> Touched:
    gone = np.concatenate([part.gone for part in parts])
    return Touched(np.concatenate([part.face for part in parts]),
                    np.concatenate([part.corner for part in parts], axis=1),
                    np.concatenate([part.label for part in parts], axis=1), gone, np.arange(len(gone)))
