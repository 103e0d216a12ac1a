# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine alone: every prefix of its record is a mesh with the input's topology, and it is always the same."""

from __future__ import annotations

import threading
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from eso_addon.core.adjacency import corner_fans, vertex_components
from eso_addon.core.batch_checks import turned
from eso_addon.core.blocks import Blocks
from eso_addon.core.collapse import Rules, collapse_steps
from eso_addon.core.mesh import MeshError
from eso_addon.core.normals import face_area_vectors
from eso_addon.core.normals import lengths as vector_lengths
from eso_addon.core.prepare import Prepared, prepare
from eso_addon.core.quadrics import anchored, area_normals, plane_quadrics
from eso_addon.core.record import CollapseRecord

from . import shapes
from .shapes import Bools, Ints, Mesh

# the makers' seeds do not shrink; failures are repeated by their seed
QUICK = settings(max_examples=30, deadline=None, derandomize=True, phases=(Phase.explicit, Phase.generate))
SEEDS = st.integers(0, 2**32)
RULES = st.sampled_from([Rules(), Rules(endpoint=True), Rules(share=1.0), Rules(flip=-1.0)])
FIELDS = ("removed", "kept", "position", "faces_left", "cost", "stays")


def plain_quadrics(mesh: Prepared, memory: float) -> np.ndarray:
    normals, areas = area_normals(mesh.points, mesh.faces)
    planes = plane_quadrics(mesh.faces, normals, areas, mesh.points.shape[1], area_weighted=True)
    return anchored(planes, mesh.points, memory)


def start(mesh: Prepared, rules: Rules, target: int = 0, *, locked: Bools | None = None, threads: int = 1) -> Any:  # noqa: ANN401
    quadrics = plain_quadrics(mesh, rules.memory)
    return collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, locked, target, rules, Blocks(threads))


def run(mesh: Prepared, rules: Rules, target: int = 0, **options: Any) -> CollapseRecord:  # noqa: ANN401
    return shapes.drained(start(mesh, rules, target, **options), 20 * mesh.faces.shape[1] + 20)[1]


def made(mesh: Mesh) -> Prepared | None:
    try:
        return prepare(*mesh)
    except MeshError:
        return None


def level(mesh: Prepared, record: CollapseRecord, length: int) -> Ints:
    return record.level(mesh.points.T, mesh.faces.T, length)[1]


def lengths(record: CollapseRecord, seed: int) -> list[int]:
    """Return some lengths of a record: its end, the ends of batches and many amid them."""
    rng = np.random.default_rng(seed)
    some = rng.choice(len(record) + 1, min(len(record) + 1, 12), replace=False)
    return sorted({len(record), *some.tolist(), *record.batch_starts[-3:].tolist()})


def assert_sound(mesh: Prepared, record: CollapseRecord, seed: int) -> None:
    """Assert what holds of any record with the guard on: counts, pieces, edges and Euler characteristics."""
    faces, count = mesh.faces.T, len(mesh.source)
    piece = vertex_components(faces, count)
    before, manifold = shapes.euler(faces, piece), (shapes.edge_uses(faces) <= 2).all()
    assert len(np.unique(record.removed)) == len(record)
    for length in lengths(record, seed):
        corners = level(mesh, record, length)
        assert len(corners) == (record.faces_left[length - 1] if length else record.faces_before)
        after = shapes.euler(corners, piece)
        assert set(after) == set(before), "a piece is lost"
        assert after == before
        assert not manifold or (shapes.edge_uses(corners) <= 2).all()


@QUICK
@given(SEEDS, RULES)
@example(7, Rules(share=1.0, spread=np.inf))
@example(99, Rules(share=1.0, spread=np.inf))
@example(319, Rules(share=1.0, spread=np.inf))
@example(364, Rules(share=1.0, spread=np.inf))
@example(2097, Rules(share=1.0))
def test_every_prefix_keeps_the_topology_of_a_manifold(seed: int, rules: Rules) -> None:
    mesh = prepare(*shapes.manifold(seed))
    record = run(mesh, rules)
    assert_sound(mesh, record, seed)
    before = shapes.topology(mesh.faces.T)
    for length in lengths(record, seed):
        corners = level(mesh, record, length)
        assert shapes.topology(corners) == before
        assert len(np.unique(np.sort(corners, axis=1), axis=0)) == len(corners), "a face twice"
        assert_array_equal(corner_fans(corners, len(mesh.source)).max() + 1, len(np.unique(corners)))
    assert np.isfinite(record.position).all()


@QUICK
@given(SEEDS, RULES)
def test_every_prefix_keeps_the_topology_at_pinched_vertices(seed: int, rules: Rules) -> None:
    mesh = prepare(*shapes.pinched(seed))
    record = run(mesh, rules)
    assert_sound(mesh, record, seed)
    before = shapes.topology(mesh.faces.T)
    for length in lengths(record, seed):
        assert shapes.topology(level(mesh, record, length)) == before


@QUICK
@given(SEEDS, RULES)
def test_every_prefix_of_anything_is_sound(seed: int, rules: Rules) -> None:
    mesh = made(shapes.anything(seed))
    if mesh is None:
        return
    record = run(mesh, rules)
    fans = corner_fans(mesh.faces.T, len(mesh.source))
    if fans.max() + 1 == len(mesh.source):
        assert_sound(mesh, record, seed)
    for length in lengths(record, seed):  # a closed part that hangs at one vertex of another may still be lost
        assert len(level(mesh, record, length)) == (record.faces_left[length - 1] if length else record.faces_before)


@QUICK
@given(SEEDS, RULES, st.booleans())
def test_anything_ends_and_is_valid_with_the_guard_or_without(seed: int, rules: Rules, guard: bool) -> None:
    mesh = made(shapes.anything(seed))
    if mesh is None:
        return
    rules = Rules(rules.endpoint, guard=guard, share=rules.share, flip=rules.flip)
    yielded, record = shapes.drained(start(mesh, rules), 20 * mesh.faces.shape[1] + 20)
    assert (np.diff([record.faces_before, *yielded]) <= 0).all()
    assert len(np.unique(record.removed)) == len(record)
    assert not np.isin(record.removed, record.kept[-1:]).any() or len(record) == 0
    assert np.isfinite(record.position).all()
    assert np.isfinite(record.cost).all()
    assert (record.cost >= 0).all()
    gone = np.full(len(mesh.source), len(record))
    gone[record.removed] = np.arange(len(record))
    assert (gone[record.kept] > np.arange(len(record))).all(), "into a vertex that is gone"
    assert record.stays.all() or not rules.endpoint


@QUICK
@given(SEEDS)
def test_the_curvature_factor_ends_too(seed: int) -> None:
    mesh = prepare(*shapes.manifold(seed))
    assert_sound(mesh, run(mesh, Rules(curvature_factor=True)), seed)


@QUICK
@given(SEEDS, RULES)
def test_batches_share_no_vertex_and_rise_in_cost(seed: int, rules: Rules) -> None:
    mesh = prepare(*shapes.manifold(seed))
    record = run(mesh, rules)
    ends = [*record.batch_starts.tolist(), len(record)]
    for first, last in pairwise(ends):
        touched = np.concatenate((record.removed[first:last], record.kept[first:last]))
        assert len(np.unique(touched)) == len(touched)
        assert (np.diff(record.cost[first:last]) >= 0).all()


@QUICK
@given(SEEDS, st.sampled_from([0.2, 0.0, 0.7]), st.booleans())
def test_no_batch_turns_a_face_over(seed: int, flip: float, endpoint: bool) -> None:
    mesh = prepare(*shapes.manifold(seed))
    record = run(mesh, Rules(flip=flip, endpoint=endpoint))
    for first, last in pairwise([*record.batch_starts.tolist(), len(record)]):
        points, corners, face, _ = record.level(mesh.points.T, mesh.faces.T, last)
        old_points, old_corners, old_face, _ = record.level(mesh.points.T, mesh.faces.T, first)
        new = face_area_vectors(points, corners)
        old = face_area_vectors(old_points, old_corners)[np.searchsorted(old_face, face)]
        size = vector_lengths(old) * vector_lengths(new)
        # in single precision, and faces next to nothing have no normal
        assert ((old * new).sum(axis=1) >= flip * size - 1e-4 * size - 1e-12).all()


def test_counts_amid_batches_are_met_and_change_nothing() -> None:
    mesh = prepare(*shapes.noisy(shapes.torus(24, 32), np.random.default_rng(0), 0.1))
    whole = run(mesh, Rules())
    for target in range(40, 1400, 23):
        record = run(mesh, Rules(), target)
        assert len(level(mesh, record, len(record))) in (target, target - 1)
        assert_array_equal(record.removed, whole.removed[: len(record)])


@QUICK
@given(SEEDS, RULES, st.floats(0.05, 1.0))
def test_a_run_to_another_count_is_a_prefix(seed: int, rules: Rules, part: float) -> None:
    mesh = prepare(*shapes.manifold(seed))
    whole = run(mesh, rules)
    target = max(int(part * mesh.faces.shape[1]), 1)
    record = run(mesh, rules, target)
    assert len(record) == whole.length_for(target)
    for name in FIELDS:
        assert_array_equal(getattr(record, name), getattr(whole, name)[: len(record)])
    assert_array_equal(record.batch_starts, whole.batch_starts[whole.batch_starts < len(record)])
    assert record.faces_left[-1:] >= target - 1 if len(record) else True


@pytest.mark.parametrize("rules", [Rules(), Rules(endpoint=True), Rules(curvature_factor=True)])
def test_threads_and_repeats_change_no_bit(rules: Rules) -> None:
    mesh = prepare(*shapes.noisy(shapes.torus(100, 200), np.random.default_rng(0), 0.004))  # several blocks
    one, two, again = (run(mesh, rules, 20_000, threads=threads) for threads in (1, 2, 2))
    for name in (*FIELDS, "batch_starts"):
        assert_array_equal(getattr(one, name), getattr(two, name))
        assert_array_equal(getattr(one, name), getattr(again, name))


@QUICK
@given(SEEDS, st.booleans(), st.floats(0, 1))
def test_locked_vertices_neither_go_nor_move(seed: int, endpoint: bool, share: float) -> None:
    mesh = prepare(*shapes.manifold(seed))
    locked = np.random.default_rng(seed).random(len(mesh.source)) < share
    record = run(mesh, Rules(endpoint=endpoint), locked=locked)
    assert not locked[record.removed].any()
    held = np.flatnonzero(locked[record.kept])
    assert_array_equal(record.position[held], mesh.points.T[record.kept[held]])
    assert record.stays[held].all()
    assert_sound(mesh, record, seed)
    if locked.all():
        assert len(record) == 0


def test_free_vertices_go_into_locked_ones() -> None:
    mesh = prepare(*shapes.sheet(6, 6))
    locked = np.zeros(49, bool)
    locked[[10, 20, 30]] = True
    record = run(mesh, Rules(), 2, locked=locked)
    assert locked[record.kept].any()
    assert np.isin([10, 20, 30], level(mesh, record, len(record))).all()


@QUICK
@given(SEEDS)
def test_half_edge_collapses_move_nothing(seed: int) -> None:
    mesh = prepare(*shapes.manifold(seed))
    record = run(mesh, Rules(endpoint=True))
    assert_array_equal(record.position, mesh.points.T[record.kept])
    assert record.stays.all()


def test_a_flat_sheet_costs_next_to_nothing() -> None:
    mesh = prepare(*shapes.sheet(20, 20, np.random.default_rng(0)))
    quadrics = plain_quadrics(mesh, 1e-9)
    _, record = shapes.drained(
        collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, None, 2, Rules(memory=1e-9), Blocks(1)))
    assert_allclose(record.cost, 0.0, atol=1e-9)
    assert_allclose(record.position[:, 2], mesh.points[2, 0], atol=1e-9)


@pytest.mark.parametrize("steps_done", [0, 1, 3])
def test_may_be_closed_at_any_time(steps_done: int) -> None:
    mesh = prepare(*shapes.ball(3))
    before = threading.active_count()
    blocks = Blocks(2)
    quadrics = plain_quadrics(mesh, 1e-7)
    given_arrays = mesh.points.copy(), mesh.faces.copy()
    steps = collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, None, 8, Rules(), blocks)
    for _ in range(steps_done):
        next(steps)
    steps.close()
    blocks.close()
    assert threading.active_count() == before
    for array, copy in zip((mesh.points, mesh.faces), given_arrays, strict=True):
        assert_array_equal(array, copy)  # the input is not touched


@given(st.floats(-25, 8), st.floats(-1, 0.99), st.integers(0, 2**32 - 1))
def test_a_face_that_stays_as_it_is_has_not_turned(digits: float, flip: float, seed: int) -> None:
    """Of any size: the squares of small ones vanish in single precision."""
    normals = (np.random.default_rng(seed).normal(size=(3, 50)) * 10.0**digits).astype(np.float32)
    state = SimpleNamespace(rules=SimpleNamespace(flip=flip))
    with np.errstate(under="ignore"):
        assert not turned(state, tuple(normals), tuple(normals)).any()
