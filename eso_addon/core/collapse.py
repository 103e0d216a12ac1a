# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine: collapses edges in batches, whole arrays at a time: weigh, choose, test, collapse, update.

A batch holds edges that are cheapest at both their ends, so no two of them share a vertex. It is ordered by cost, and
each collapse is tested in the state that the cheaper ones leave: any prefix of the record is a valid mesh.

Faces are three rows of corners; the side from corner j to the next has a cost in row j, finite in one of its two faces
only (where the corner has the lower number), so edges need no list of their own.
"""

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from .alone import fails_alone
from .blocks import Blocks
from .manifold import boundary_fans
from .mesh import Bools, Floats, Ints
from .quadrics import (
    Components,
    cross,
    endpoint_costs,
    move_memory,
    optimal_costs,
    optimal_places,
)
from .record import CollapseRecord
from .variation import angle_defects_and_areas, edge_curvature_factor

_NONE = np.iinfo(np.int64).max
_LOW = (1 << 32) - 1
# an odd multiplier and its inverse: ties of cost are broken in no spatial order, and the slot can be read back
_SCATTER = 0x9E3779B1
_GATHER = pow(_SCATTER, -1, 1 << 32)
# faces a block: its arrays stay in the second cache
_BLOCK = 16384
_SAMPLES = 4096
# edges that are tried alone before a batch is chosen from them
_FEW = 8192
# no face may shrink to less than this part of its area: flat meshes would fill with faces without any
_SLIVER = 1e-3
# with fewer faces than this the share shrinks with them: small meshes are collapsed with more care
_LARGE = 20_000


@dataclass(frozen=True)
class Rules:
    """What the engine may do.

    Attributes
    ----------
    endpoint : bool
        Keep one of the two vertices where it stands (half-edge collapse); else move it to the optimal place.
    memory : float
        How strongly a vertex holds to its place, relative to its quadric.
    flip : float
        Least cosine between a face's normals before and after.
    guard : bool
        The link condition: no collapse changes the topology.
    share : float
        The part of the edges, the cheapest, from which a batch is chosen.
    careful : float
        On small meshes the share shrinks with the faces, to this part of it.
    few : int
        Where no more edges than this are left to try, all of them may go.
    passes : int
        How often a batch is filled up with edges that are cheapest among those that its vertices leave over.
    spread : float
        These edges cost at most so many times what the cheapest eighth of them does.
    curvature_factor : bool
        Multiply costs by Equation 5, renewed where collapses change it.
    """

    endpoint: bool = False
    memory: float = 1e-9
    flip: float = 0.5
    guard: bool = True
    share: float = 0.5
    careful: float = 0.3
    few: int = 0
    passes: int = 1
    spread: float = 3.0
    curvature_factor: bool = False


class Guide(Protocol):
    """Weighs edges by the mesh as it is before each batch, in place of the quadrics; survivors stay where they are."""

    def hold(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool."""

    def weigh(self, points: Floats, faces: Ints, survivor: Ints, blocks: Blocks) -> np.ndarray:
        """Return the cost of each side, (3, m) float32, infinite where neither end may go."""

    def swaps(self, one: Ints, other: Ints) -> Bools:
        """Tell where the first vertex of an edge goes and the second stays."""

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses of the batch that must not be done beside the others."""


class Lines(Protocol):
    """Edges that are simplified along themselves, and never across."""

    def lock(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool, where they are."""

    def holds(self, one: Ints, other: Ints) -> tuple[Bools, Bools]:
        """Tell which end of each edge must stay where it is; where both must, the edge may not go."""

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses of the batch after which two lines would be one."""

    def follow(self, survivor: Ints) -> None:
        """Take note of a batch that was carried out."""

    def tolls(self, one: Ints, other: Ints) -> np.ndarray:
        """Return what the cost of each edge is multiplied by, (e,) float32."""


@dataclass
class _State:
    """The mesh on its way down; n vertices in Morton order, m faces, and a vertex n for dead faces."""

    rules: Rules
    blocks: Blocks
    points: Floats  # (n + 1, 4) rows, the last column unused: rows of 32 bytes are gathered fastest
    quadrics: Floats  # (n, 12)
    faces: Ints  # (3, m)
    boundary: Bools  # (n + 1,)
    fans: Ints  # (n + 1,) runs of faces from boundary to boundary
    locked: Bools | None  # (n,)
    alive: int
    guide: Guide | None = None
    lines: Lines | None = None
    costs: np.ndarray = field(init=False)  # (3, m) float32
    base: np.ndarray = field(init=False)  # (3, m) float32, costs before the curvature factor
    dead: int = 0

    def __post_init__(self) -> None:
        count = self.nowhere
        sides = self.points.take(self.faces[0], axis=0) - self.points.take(self.faces[1], axis=0)
        # normals are compared in single precision: in units of an edge their squares neither vanish nor overflow
        self.unit = 1.0 / max(float(np.sqrt((sides * sides).sum(axis=1)).mean()), 1e-300)
        before = (self.points * self.unit).astype(np.float32)
        self.rows = np.concatenate((before, before))
        self.before, self.after = self.rows[: count + 1], self.rows[count + 1 :]  # `after` as the batch would have it
        self.open = bool(self.boundary.any())
        self.best = np.full(count + 1, _NONE)
        self.label = ~np.arange(count + 1)  # of vertices in no collapse: negative, each its own
        self.survivor = np.arange(count + 1)
        self.owner = np.zeros(4 * count + 8, np.int64)


    @property
    def holding(self) -> bool:
        """Whether some vertices may not move."""
        return self.locked is not None or self.lines is not None

    @property
    def nowhere(self) -> int:
        """The vertex of dead faces: one more than there are."""
        return len(self.points) - 1


@dataclass
class _Batch:
    """Collapses by rising cost: (c,) arrays, and what they touch block by block."""

    one: Ints
    other: Ints
    slot: Ints
    cost: np.ndarray
    quadrics: Floats
    places: Floats  # (c, 4)
    stays: Bools
    bad: Bools
    at_boundary: Bools
    unsure: Bools  # refused beside a cheaper one that was refused too: they may pass without it
    falling: Ints = field(init=False)
    touched: list["_Touched"] = field(default_factory=list)


@dataclass
class _Touched:
    """Faces with a corner in the batch: (t,) indices, (3, t) corners and labels, and the collapse that removes each."""

    face: Ints
    corner: Ints
    label: Ints
    gone: Ints
    mixed: Ints  # those in several collapses, as places in the arrays above

    def take(self, faces: Ints) -> "_Touched":
        """Return some of the faces, all of them mixed."""
        return _Touched(self.face.take(faces), self.corner.take(faces, axis=1), self.label.take(faces, axis=1),
                        self.gone.take(faces), np.arange(len(faces)))


# of each corner that stays, its collapse and the next vertex; of those at a boundary, also the previous one
_Links = tuple[Ints, Ints, Ints, Ints]

def collapse_steps(points: Floats, faces: Ints, quadrics: Floats, boundary: Bools, locked: Bools | None, target: int,
                   rules: Rules, blocks: Blocks,
                   guide: Guide | None = None, lines: Lines | None = None) -> Generator[int, None, CollapseRecord]:
    """Collapse edges until `target` faces are left or nothing more can go.

    Parameters
    ----------
    points : ndarray, (3, n) float64
        About the origin and of about unit size, in an order that keeps neighbours together.
    faces : ndarray, (3, m) int64
        Corners, in rows.
    quadrics : ndarray, (n, 12) float64
        Changed: those of the survivors at the end.
    boundary : ndarray, (n,) bool
        Vertices with a boundary edge.
    locked : ndarray, (n,) bool, or None
        Vertices that neither go nor move.
    target : int
    rules : Rules
    blocks : Blocks
    guide : Guide, optional
        Weighs in place of the quadrics, which may then be zeros; with endpoint placement only.
    lines : Lines, optional
        Says what may go along them; of no use beside a guide.

    Yields
    ------
    int
        Faces left after each batch.

    Returns
    -------
    CollapseRecord
        Positions are the engine's.
    """
    rows = np.zeros((points.shape[1] + 1, 4))
    rows[:-1, :3] = points.T
    fans = boundary_fans(faces, np.append(boundary, False))
    if (fans > 1).any():  # boundaries meet there: such vertices stay where they are
        locked = (fans[:-1] > 1) if locked is None else locked | (fans[:-1] > 1)
    state = _State(rules, blocks, rows, quadrics, faces.copy(), np.append(boundary, False), fans, locked,
                   faces.shape[1], guide, lines)
    if guide is not None and locked is not None:
        guide.hold(locked)
    if lines is not None and locked is not None:
        lines.lock(locked)
    history: list[tuple] = []
    faces_before = state.alive
    _weigh(state)
    fresh = True
    while state.alive > target:
        batch = _choose(state)
        if batch is None:
            if fresh:
                break
            _weigh(state)  # rejected edges may have become possible
            fresh = True
            continue
        _test(state, batch)
        done = _collapse(state, batch, target)
        if done is not None:
            history.append(done)
            fresh = False
        yield state.alive
    return _record(history, faces_before)


def _weigh(state: _State) -> None:
    """Give every side the cost of its edge, in the face where it counts."""
    count = state.faces.shape[1]
    state.base = np.full((3, count), np.inf, np.float32)

    def weigh(part: slice) -> None:
        corner = state.faces[:, part]
        for side in range(3):
            start, end = corner[side], corner[(side + 1) % 3]
            chosen = np.flatnonzero(_counts(state, start, end))
            state.base[side, part][chosen] = _edge_costs(state, start.take(chosen), end.take(chosen))

    state.blocks.map(weigh, count, _BLOCK)
    _apply_factor(state)


def _counts(state: _State, start: Ints, end: Ints) -> Bools:
    """Tell the sides that carry their edge's cost: one of two, but each where a boundary may have left it alone."""
    lower = start < end
    return lower | (state.boundary.take(start) & state.boundary.take(end)) if state.open else lower


def _edge_costs(state: _State, one: Ints, other: Ints) -> np.ndarray:
    if state.guide is not None:
        return np.zeros(len(one), np.float32)  # the guide adds its costs to what was not rejected
    if state.rules.endpoint:
        at_one, at_other = endpoint_costs(state.quadrics, state.points, one, other)
        if state.holding:
            holds_one, holds_other = _holds(state, one, other)
            at_other[holds_one] = np.inf
            at_one[holds_other] = np.inf
            if state.lines is not None:
                return np.minimum(at_one, at_other) * state.lines.tolls(one, other)
        return np.minimum(at_one, at_other)
    costs = optimal_costs(state.quadrics, one, other)
    if state.holding:
        holds_one, holds_other = _holds(state, one, other)
        held = np.flatnonzero(holds_one | holds_other)
        at_one, at_other = endpoint_costs(state.quadrics, state.points, one.take(held), other.take(held))
        holds_one, holds_other = holds_one.take(held), holds_other.take(held)
        costs[held] = np.where(holds_one, np.where(holds_other, np.inf, at_one), at_other)
        if state.lines is not None:
            costs *= state.lines.tolls(one, other)
    return costs


def _holds(state: _State, one: Ints, other: Ints) -> tuple[Bools, Bools]:
    """Tell which end of each edge may not move; where neither may, the edge may not go."""
    if state.lines is not None:
        return state.lines.holds(one, other)
    assert state.locked is not None
    return state.locked.take(one), state.locked.take(other)


def _apply_factor(state: _State) -> None:
    """Multiply by the curvature factor of Equation 5, or let the guide weigh, as the mesh is now."""
    if state.guide is not None:
        state.costs = state.guide.weigh(state.points, state.faces, state.survivor, state.blocks)
        state.costs += state.base
        return
    if not state.rules.curvature_factor:
        state.costs = state.base
        return
    alive = np.flatnonzero(state.faces[0] < state.nowhere)
    defects, areas = angle_defects_and_areas(state.points[:-1, :3], state.faces.take(alive, axis=1).T)
    ends = np.stack((state.faces, np.roll(state.faces, -1, axis=0)), axis=-1).reshape(-1, 2)
    finite = np.flatnonzero(np.isfinite(state.base.ravel()))
    state.costs = state.base.copy()
    state.costs.ravel()[finite] *= edge_curvature_factor(defects, areas, ends.take(finite, axis=0)).astype(np.float32)


def _choose(state: _State) -> _Batch | None:
    """Choose the edges that are the cheapest at both ends, among the cheapest part of all."""
    if state.guide is not None:
        _sieve(state, state.guide)
    threshold = _threshold(state)
    if threshold is None:
        return None
    one, other, keys = _candidates(state, threshold)
    chosen: list[Ints] = []
    best, taken = np.zeros(0, np.int64), np.zeros(len(state.points), bool)
    for _ in range(state.rules.passes):
        if chosen:
            taken[one.take(best)] = taken[other.take(best)] = True
            left = np.flatnonzero(~(taken.take(one) | taken.take(other)))
            one, other, keys = one.take(left), other.take(left), keys.take(left)
        np.minimum.at(state.best, one, keys)
        np.minimum.at(state.best, other, keys)
        best = np.flatnonzero((state.best.take(one) == keys) & (state.best.take(other) == keys))
        state.best[one] = _NONE
        state.best[other] = _NONE
        chosen.append(keys.take(best))
    keys = np.sort(np.concatenate(chosen))
    slot = ((keys & _LOW) * _GATHER) & _LOW
    return _place(state, slot, (keys >> 32).astype(np.int32).view(np.float32))


def _sieve(state: _State, guide: Guide) -> None:
    """Reject what fails even alone, once few edges are left: most of them do."""
    slot = np.flatnonzero(np.isfinite(state.costs))
    if not 0 < len(slot) <= _FEW:
        return
    one, other = _ends(state.faces, slot)
    swap = guide.swaps(one, other)
    fails = fails_alone(state.before, state.faces, state.boundary, np.where(swap, one, other),
                        np.where(swap, other, one), lambda old, new: _turned(state, old, new))
    state.base.ravel()[slot[fails]] = state.costs.ravel()[slot[fails]] = np.inf


def _threshold(state: _State) -> np.float32 | None:
    """Return the cost up to which edges may go now: of the cheapest part, and not far above the very cheapest."""
    costs = state.costs.ravel()
    sample = costs[:: max(len(costs) // _SAMPLES, 1)]
    sample = sample[np.isfinite(sample)]
    if len(sample) < 64:
        sample = costs[np.isfinite(costs)]
        if len(sample) == 0:
            return None
    last = len(sample) - 1
    if last < state.rules.few:
        return sample.max()
    share = state.rules.share * min(max(state.alive / _LARGE, state.rules.careful), 1.0)
    cheapest, cheap = int(share / 8 * last), int(share * last)
    sample = np.partition(sample, (cheapest, cheap))
    return min(sample[cheap], state.rules.spread * sample[cheapest])


def _candidates(state: _State, threshold: np.float32) -> tuple[Ints, Ints, Ints]:
    """Return both vertices of the edges up to a cost, and keys that order them: cost above, scattered slot below."""
    width = state.faces.shape[1]

    def find(part: slice) -> list:
        found = []
        for side in range(3):
            face = np.flatnonzero(state.costs[side, part] <= threshold) + part.start
            keys = state.costs[side].take(face).view(np.int32).astype(np.int64) << 32
            keys |= ((face + side * width) * _SCATTER) & _LOW
            found.append((state.faces[side].take(face), state.faces[(side + 1) % 3].take(face), keys))
        return found

    found = [side for block in state.blocks.map(find, width, _BLOCK) for side in block]
    one, other, keys = (np.concatenate(rows) for rows in zip(*found, strict=True))
    return one, other, keys


def _ends(faces: Ints, slots: Ints) -> tuple[Ints, Ints]:
    corners = faces.ravel()
    following = slots + faces.shape[1]
    np.subtract(following, len(corners), out=following, where=following >= len(corners))
    return corners.take(slots), corners.take(following)


def _place(state: _State, slot: Ints, cost: np.ndarray) -> _Batch:
    """Find where the vertex of each chosen edge is to stand and which of the two goes, and label both."""
    one, other = _ends(state.faces, slot)
    count = len(slot)
    batch = _Batch(one, other, slot, cost, np.empty((count, state.quadrics.shape[1])), np.zeros((count, 4)),
                   np.zeros(count, bool), np.zeros(count, bool), state.boundary.take(one) | state.boundary.take(other),
                   np.zeros(count, bool))

    def merge(part: slice) -> None:
        one, other = batch.one[part], batch.other[part]
        if state.guide is not None:
            swap = state.guide.swaps(one, other)
            batch.one[part], batch.other[part] = np.where(swap, other, one), np.where(swap, one, other)
            batch.places[part], batch.stays[part] = state.points.take(batch.one[part], axis=0), True
            return
        first, second = state.quadrics.take(one, axis=0), state.quadrics.take(other, axis=0)
        starts, ends = state.points.take(one, axis=0).T[:3], state.points.take(other, axis=0).T[:3]
        summed = first + second
        swap, stays = _stays(state, one, other)
        places = starts
        if stays.any():
            places = np.where(swap, ends, starts)
            batch.one[part], batch.other[part] = np.where(swap, other, one), np.where(swap, one, other)
        if not stays.all():
            places = np.where(stays, places, optimal_places(summed)) if stays.any() else optimal_places(summed)
        move_memory(summed, first, second, starts, ends, places, state.rules.memory)
        batch.quadrics[part], batch.places[part, :3], batch.stays[part] = summed, places.T, stays

    def place(part: slice) -> None:
        merge(part)
        one, other = batch.one[part], batch.other[part]
        state.label[one] = state.label[other] = np.arange(part.start, part.stop)
        state.survivor[other] = one
        state.after[one] = state.after[other] = batch.places[part] * state.unit

    state.blocks.map(place, count, _BLOCK // 4)
    return batch


def _stays(state: _State, one: Ints, other: Ints) -> tuple[Bools, Bools]:
    """Tell where the second vertex is the one to keep, and where the kept vertex may not move."""
    stays = np.full(len(one), state.rules.endpoint)
    swap = np.zeros(len(one), bool)
    if state.rules.endpoint:
        at_one, at_other = endpoint_costs(state.quadrics, state.points, one, other)
        swap = at_other < at_one
    if state.holding:
        holds_one, holds_other = _holds(state, one, other)
        stays |= holds_one | holds_other
        swap = np.where(holds_one | holds_other, holds_other, swap)
    return swap, stays


def _test(state: _State, batch: _Batch) -> None:
    """Mark the collapses that would turn a face over or change the topology."""
    count = len(batch.one)
    def test(part: slice) -> tuple[_Touched, Ints, Ints, _Links]:
        touched = _touched(state, part)
        falling = touched.gone.take(np.flatnonzero(touched.gone != _NONE))
        return touched, falling, _flips(state, touched), _links(state, batch, touched)

    tested = state.blocks.map(test, state.faces.shape[1], _BLOCK)
    batch.touched = [touched for touched, _, _, _ in tested]
    batch.falling = np.bincount(np.concatenate([falling for _, falling, _, _ in tested]), minlength=count)
    rejected = np.zeros(count, bool)
    for _, _, flipped, _ in tested:
        rejected[flipped] = True
    if state.rules.guard:
        rejected |= _broken(state, batch, [links for _, _, _, links in tested], np.arange(count))
    bound = state.guide or state.lines
    if bound is not None:
        rejected[bound.clashes(state.survivor, state.label)] = True
    while rejected.any():
        rejected = _reject(state, batch, rejected)
        if bound is not None and not rejected.any():
            rejected[bound.clashes(state.survivor, state.label)] = True


def _touched(state: _State, part: slice) -> _Touched:
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
    mixed = np.flatnonzero(collapses[0] + collapses[1] + collapses[2] - (gone != _NONE) > 1)
    return _Touched(face + part.start, touched[0], label, gone, mixed)


def _removers(label: Ints) -> Ints:
    """Return the collapse that has two corners of each face, else none."""
    first, second, third = label
    by_first, by_second = (first == second) | (first == third), second == third
    # sums of products: a choice by a mask costs three times as much
    return _NONE - (_NONE - first) * by_first - (_NONE - second) * (by_second & ~by_first)


def _flips(state: _State, touched: _Touched) -> Ints:
    """Return the collapses that turn a face too far, each in the state that the cheaper ones leave."""
    corner, label = touched.corner, touched.label
    old = _normals(state.before, corner)
    flipped = np.flatnonzero(_turned(state, old, _normals(state.after, corner)) & (touched.gone == _NONE))
    found = [label.take(flipped, axis=1).max(axis=0, initial=-1)]
    # faces of several collapses pass through states in between
    own_labels = label.take(touched.mixed, axis=1)
    last = np.minimum(own_labels.max(axis=0, initial=-1), touched.gone.take(touched.mixed)).view(np.uint64)
    for side in range(3):
        own = own_labels[side]
        between = np.flatnonzero(own.view(np.uint64) < last)
        face, own = touched.mixed.take(between), own.take(between)
        moved = label.take(face, axis=1).view(np.uint64) <= own.view(np.uint64)
        new = _normals(state.rows, corner.take(face, axis=1) + moved * len(state.points))
        found.append(own[_turned(state, [axis.take(face) for axis in old], new)])
    return np.concatenate(found)


def _turned(state: _State, old: Components, new: Components) -> Bools:
    turn = old[0] * new[0] + old[1] * new[1] + old[2] * new[2]
    was, becomes = (side[0] * side[0] + side[1] * side[1] + side[2] * side[2] for side in (old, new))
    least = state.rules.flip
    needed = np.maximum(np.float32(least * abs(least)) * becomes, np.float32(_SLIVER**2) * was)
    return (turn * np.abs(turn) <= needed * was) & (was > 0)


def _normals(rows: np.ndarray, corner: Ints) -> tuple:
    base = rows.take(corner[0], axis=0)
    return cross((rows.take(corner[1], axis=0) - base).T, (rows.take(corner[2], axis=0) - base).T)


def _links(state: _State, batch: _Batch, touched: _Touched, among: Bools | None = None) -> _Links:
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


def _at_turn(state: _State, touched: _Touched, side: int, chosen: Ints, own: Ints) -> Ints:
    """Return the corners of the chosen faces at one side, as the collapses before their own leave them."""
    corner = touched.corner[side].take(chosen)
    before = np.flatnonzero(touched.label[side].take(chosen).view(np.uint64) < own.view(np.uint64))
    corner[before] = state.survivor.take(corner.take(before))
    return corner


def _broken(state: _State, batch: _Batch, links: list[_Links], which: Ints) -> Bools:
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


def _rivals(state: _State, links: list[_Links]) -> Ints:
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


def _withdraw(state: _State, batch: _Batch, out: Bools) -> None:
    """Take collapses out of the batch, as if they had not been chosen."""
    batch.bad |= out
    for end in (batch.one[out], batch.other[out]):
        state.after[end] = state.before[end]
        state.label[end] = ~end
        state.survivor[end] = end


def _reject(state: _State, batch: _Batch, rejected: Bools) -> Bools:
    """Take collapses out of the batch; return those that fail without them."""
    _withdraw(state, batch, rejected)
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
    out = np.where(outcast.take(label + 1, mode="clip"), label, _NONE)
    return out[(out > out.min(axis=0)) & (out < _NONE)]


def _among(some: Bools, label: Ints | list[Ints]) -> Ints:
    """Return the faces with a corner in some of the collapses, (c + 1,) bool after a False."""
    one, two, three = (some.take(row + 1, mode="clip") for row in label)
    return np.flatnonzero(one | two | three)


def _joined(parts: list[_Touched]) -> _Touched:
    gone = np.concatenate([part.gone for part in parts])
    return _Touched(np.concatenate([part.face for part in parts]),
                    np.concatenate([part.corner for part in parts], axis=1),
                    np.concatenate([part.label for part in parts], axis=1), gone, np.arange(len(gone)))


def _collapse(state: _State, batch: _Batch, target: int) -> tuple | None:
    """Carry out the batch, as far as the target asks, and renew what it touched."""
    falling = np.where(batch.bad, 0, batch.falling)
    removed = np.cumsum(falling)
    late = np.zeros(len(removed), bool)
    late[np.searchsorted(removed, state.alive - target) + 1 :] = True
    # where all failed nothing but this tells that the unsure ones are left to try
    failed = batch.slot[batch.bad & ~(batch.unsure & batch.bad.all())]
    _withdraw(state, batch, late & ~batch.bad)
    chosen = np.flatnonzero(~batch.bad)
    kept, gone, places = batch.one.take(chosen), batch.other.take(chosen), batch.places.take(chosen, axis=0)

    def carry_out(part: slice) -> None:
        vertices = kept[part]
        state.quadrics[vertices] = batch.quadrics.take(chosen[part], axis=0)
        state.points[vertices] = places[part]
        state.before[vertices] = state.after.take(vertices, axis=0)
        state.boundary[vertices] |= state.boundary.take(gone[part])
        state.fans[vertices] += state.fans.take(gone[part]) - (batch.falling.take(chosen[part]) == 1)

    state.blocks.map(carry_out, len(chosen), _BLOCK // 4)
    if state.lines is not None:
        state.lines.follow(state.survivor)
    _update(state, batch)
    state.base.ravel()[failed] = np.inf
    state.label[kept], state.label[gone] = ~kept, ~gone
    if len(chosen) == 0:
        state.costs.ravel()[failed] = np.inf
        return None
    faces_left = state.alive - removed.take(chosen)
    state.dead += state.alive - int(faces_left[-1])
    state.alive = int(faces_left[-1])
    if state.dead > state.faces.shape[1] // 4:
        _pack(state)
    _apply_factor(state)
    return gone, kept, places[:, :3], faces_left, batch.cost.take(chosen), batch.stays.take(chosen)


def _update(state: _State, batch: _Batch) -> None:
    """Replace the corners that went, drop the faces that fell, and weigh the sides whose vertices changed."""
    nowhere, width, base = state.nowhere, state.faces.shape[1], state.base.ravel()
    falling = np.append(~batch.bad, False)  # no remover clips to the last,
    done = np.append(False, ~batch.bad)  # and no collapse to the first

    def update(block: slice) -> None:
        touched = batch.touched[block.start]
        falls = falling.take(touched.gone, mode="clip")
        fallen = touched.face.take(np.flatnonzero(falls))
        staying = np.flatnonzero(~falls)
        face = touched.face.take(staying)
        corner = [state.survivor.take(row.take(staying)) for row in touched.corner]
        changed = [done.take(row.take(staying) + 1, mode="clip") for row in touched.label]
        places, starts, ends = [], [], []
        for side in range(3):
            state.faces[side][fallen] = nowhere
            state.faces[side][face] = corner[side]
            stale = np.flatnonzero(changed[side] | changed[(side + 1) % 3])
            start, end = corner[side].take(stale), corner[(side + 1) % 3].take(stale)
            place = face.take(stale) + side * width
            base[fallen + side * width] = np.inf
            base[place] = np.inf
            weighed = np.flatnonzero(_counts(state, start, end))
            places.append(place.take(weighed))
            starts.append(start.take(weighed))
            ends.append(end.take(weighed))
        base[np.concatenate(places)] = _edge_costs(state, np.concatenate(starts), np.concatenate(ends))

    state.blocks.map(update, len(batch.touched), 1)


def _pack(state: _State) -> None:
    alive = np.flatnonzero(state.faces[0] < state.nowhere)
    state.faces = state.faces.take(alive, axis=1)
    state.base = state.base.take(alive, axis=1)
    state.dead = 0


def _record(history: list[tuple], faces_before: int) -> CollapseRecord:
    if not history:
        none = np.zeros(0, np.int64)
        return CollapseRecord(none, none, np.zeros((0, 3)), none, np.zeros(0, np.float32), none, faces_before,
                              np.zeros(0, bool))
    removed, kept, places, faces_left, cost, stays = zip(*history, strict=True)
    starts = np.cumsum([0] + [len(part) for part in removed[:-1]])
    return CollapseRecord(np.concatenate(removed), np.concatenate(kept), np.concatenate(places),
                          np.concatenate(faces_left), np.concatenate(cost), starts, faces_before,
                          np.concatenate(stays))
