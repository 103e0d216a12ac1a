# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine: collapses edges in batches, whole arrays at a time: weigh, choose, test, collapse, update.

A batch holds edges that are cheapest at both their ends, so no two of them share a vertex. It is ordered by cost, and
each collapse is tested in the state that the cheaper ones leave: any prefix of the record is a valid mesh.

Faces are three rows of corners; the side from corner j to the next has a cost in row j, finite in one of its two faces
only (where the corner has the lower number), so edges need no list of their own.
"""

from collections.abc import Generator

import numpy as np

from .alone import fails_alone
from .batch_checks import check_batch, turned, withdraw
from .blocks import Blocks
from .engine_state import BLOCK, NONE, Batch, Guide, Rules, State
from .manifold import boundary_fans
from .mesh import Bools, Floats, Ints
from .quadrics import endpoint_costs, move_memory, optimal_costs, optimal_places, settle
from .record import CollapseRecord
from .variation import angle_defects_and_areas, edge_curvature_factor

_LOW = (1 << 32) - 1
# an odd multiplier and its inverse: ties of cost are broken in no spatial order, and the slot can be read back
_SCATTER = 0x9E3779B1
_GATHER = pow(_SCATTER, -1, 1 << 32)
_SAMPLES = 4096
# edges that are tried alone before a batch is chosen from them
_FEW = 8192
# with fewer faces than this the share shrinks with them: small meshes are collapsed with more care
_LARGE = 20_000


def collapse_steps(points: Floats, faces: Ints, quadrics: Floats, boundary: Bools, locked: Bools | None, target: int,
                   rules: Rules, blocks: Blocks,
                   guide: Guide | None = None) -> Generator[int, None, CollapseRecord]:
    """Collapse edges until `target` faces are left or nothing more can go.

    Parameters
    ----------
    points : ndarray, (3, n) float64
        About the origin and of about unit size, in an order that keeps neighbours together.
    faces : ndarray, (3, m) int64
        Corners, in rows.
    quadrics : ndarray, (n, 12 or wider) float64
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

    Yields
    ------
    int
        Faces left after each batch.

    Returns
    -------
    CollapseRecord
        Positions are the engine's.
    """
    state = _begun(points, faces, quadrics, boundary, locked, rules, blocks, guide)
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
        check_batch(state, batch)
        done = _collapse(state, batch, target)
        if done is not None:
            history.append(done)
            fresh = False
        yield state.alive
    return _record(history, faces_before)


def _begun(points: Floats, faces: Ints, quadrics: Floats, boundary: Bools, locked: Bools | None, rules: Rules,
           blocks: Blocks, guide: Guide | None) -> State:
    rows = np.zeros((points.shape[1] + 1, 4))
    rows[:-1, :3] = points.T
    fans = boundary_fans(faces, np.append(boundary, False))
    if (fans > 1).any():  # boundaries meet there: such vertices stay where they are
        locked = (fans[:-1] > 1) if locked is None else locked | (fans[:-1] > 1)
    if guide is not None and locked is not None:
        guide.hold(locked)
    return State(rules, blocks, rows, quadrics, faces.copy(), np.append(boundary, False), fans, locked,
                 faces.shape[1], guide)


def _weigh(state: State) -> None:
    """Give every side the cost of its edge, in the face where it counts."""
    count = state.faces.shape[1]
    state.base = np.full((3, count), np.inf, np.float32)

    def weigh(part: slice) -> None:
        corner = state.faces[:, part]
        for side in range(3):
            start, end = corner[side], corner[(side + 1) % 3]
            chosen = np.flatnonzero(_counts(state, start, end))
            state.base[side, part][chosen] = _edge_costs(state, start.take(chosen), end.take(chosen))

    state.blocks.map(weigh, count, BLOCK)
    _apply_factor(state)


def _counts(state: State, start: Ints, end: Ints) -> Bools:
    """Tell the sides that carry their edge's cost: one of two, but each where a boundary may have left it alone."""
    lower = start < end
    return lower | (state.boundary.take(start) & state.boundary.take(end)) if state.open else lower


def _edge_costs(state: State, one: Ints, other: Ints) -> np.ndarray:
    if state.guide is not None:
        return np.zeros(len(one), np.float32)  # the guide adds its costs to what was not rejected
    return _endpoint_costs(state, one, other) if state.rules.endpoint else _optimal_costs(state, one, other)


def _endpoint_costs(state: State, one: Ints, other: Ints) -> np.ndarray:
    at_one, at_other = endpoint_costs(state.quadrics, state.points, one, other)
    if state.locked is not None:
        at_other[state.locked.take(one)] = np.inf
        at_one[state.locked.take(other)] = np.inf
    return np.minimum(at_one, at_other)


def _optimal_costs(state: State, one: Ints, other: Ints) -> np.ndarray:
    costs = optimal_costs(state.quadrics, one, other)
    if state.locked is not None:
        held = np.flatnonzero(state.locked.take(one) | state.locked.take(other))
        costs[held] = _endpoint_costs(state, one.take(held), other.take(held))
    return costs


def _apply_factor(state: State) -> None:
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


def _choose(state: State) -> Batch | None:
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
        state.best[one] = NONE
        state.best[other] = NONE
        chosen.append(keys.take(best))
    keys = np.sort(np.concatenate(chosen))
    slot = ((keys & _LOW) * _GATHER) & _LOW
    return _place(state, slot, (keys >> 32).astype(np.int32).view(np.float32))


def _sieve(state: State, guide: Guide) -> None:
    """Reject what fails even alone, once few edges are left: most of them do."""
    slot = np.flatnonzero(np.isfinite(state.costs))
    if not 0 < len(slot) <= _FEW:
        return
    one, other = _ends(state.faces, slot)
    swap = guide.swaps(one, other)
    fails = fails_alone(state.before, state.faces, state.boundary, np.where(swap, one, other),
                        np.where(swap, other, one), lambda old, new: turned(state, old, new))
    state.base.ravel()[slot[fails]] = state.costs.ravel()[slot[fails]] = np.inf


def _threshold(state: State) -> np.float32 | None:
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


def _candidates(state: State, threshold: np.float32) -> tuple[Ints, Ints, Ints]:
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

    found = [side for block in state.blocks.map(find, width, BLOCK) for side in block]
    one, other, keys = (np.concatenate(rows) for rows in zip(*found, strict=True))
    return one, other, keys


def _ends(faces: Ints, slots: Ints) -> tuple[Ints, Ints]:
    corners = faces.ravel()
    following = slots + faces.shape[1]
    np.subtract(following, len(corners), out=following, where=following >= len(corners))
    return corners.take(slots), corners.take(following)


def _place(state: State, slot: Ints, cost: np.ndarray) -> Batch:
    """Find where the vertex of each chosen edge is to stand and which of the two goes, and label both."""
    one, other = _ends(state.faces, slot)
    count = len(slot)
    batch = Batch(one, other, slot, cost, np.empty((count, state.quadrics.shape[1])), np.zeros((count, 4)),
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
        settle(summed)
        batch.quadrics[part], batch.places[part, :3], batch.stays[part] = summed, places.T, stays

    def place(part: slice) -> None:
        merge(part)
        one, other = batch.one[part], batch.other[part]
        state.label[one] = state.label[other] = np.arange(part.start, part.stop)
        state.survivor[other] = one
        state.after[one] = state.after[other] = batch.places[part] * state.unit

    state.blocks.map(place, count, BLOCK // 4)
    return batch


def _stays(state: State, one: Ints, other: Ints) -> tuple[Bools, Bools]:
    """Tell where the second vertex is the one to keep, and where the kept vertex may not move."""
    stays = np.full(len(one), state.rules.endpoint)
    swap = np.zeros(len(one), bool)
    if state.rules.endpoint:
        at_one, at_other = endpoint_costs(state.quadrics, state.points, one, other)
        swap = at_other < at_one
    if state.locked is not None:
        holds_one, holds_other = state.locked.take(one), state.locked.take(other)
        stays |= holds_one | holds_other
        swap = np.where(holds_one | holds_other, holds_other, swap)
    return swap, stays


def _collapse(state: State, batch: Batch, target: int) -> tuple | None:
    """Carry out the batch, as far as the target asks, and renew what it touched."""
    falling = np.where(batch.bad, 0, batch.falling)
    removed = np.cumsum(falling)
    late = np.zeros(len(removed), bool)
    late[np.searchsorted(removed, state.alive - target) + 1 :] = True
    # where all failed nothing but this tells that the unsure ones are left to try
    failed = batch.slot[batch.bad & ~(batch.unsure & batch.bad.all())]
    withdraw(state, batch, late & ~batch.bad)
    chosen = np.flatnonzero(~batch.bad)
    kept, gone, places = batch.one.take(chosen), batch.other.take(chosen), batch.places.take(chosen, axis=0)

    def carry_out(part: slice) -> None:
        vertices = kept[part]
        state.quadrics[vertices] = batch.quadrics.take(chosen[part], axis=0)
        state.points[vertices] = places[part]
        state.before[vertices] = state.after.take(vertices, axis=0)
        state.boundary[vertices] |= state.boundary.take(gone[part])
        state.fans[vertices] += state.fans.take(gone[part]) - (batch.falling.take(chosen[part]) == 1)

    state.blocks.map(carry_out, len(chosen), BLOCK // 4)
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


def _update(state: State, batch: Batch) -> None:
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


def _pack(state: State) -> None:
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
