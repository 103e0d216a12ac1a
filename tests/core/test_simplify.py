# SPDX-License-Identifier: GPL-3.0-or-later
"""Targets, maps, seams and levels: what `simplify` and `lod_chain` promise."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, assume, example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from eso_addon.core.adjacency import boundary_edges, nonmanifold_edges, vertex_components
from eso_addon.core.deviation import measure
from eso_addon.core.mesh import MeshError, check_mesh
from eso_addon.core.simplify import (
    SimplifyResult,
    lod_chain,
    lod_chain_steps,
    simplify,
    simplify_steps,
)
from eso_addon.core.variation import METHODS

from . import shapes
from .shapes import Floats, Ints, Mesh

QUICK = settings(max_examples=25, deadline=None, derandomize=True, phases=(Phase.explicit, Phase.generate))
SEEDS = st.integers(0, 2**32)
OPTIONS = st.sampled_from([{}, {"flips": False}, {"refit": False}, {"placement": "endpoint"},
                           {"method": "qem", "refit": False}, {"method": "so"}, {"weld": False}, {"preset": "paper"}])
ROUGH = shapes.noisy(shapes.torus(24, 32), np.random.default_rng(0), 0.02)


def rows(array: Floats) -> list[tuple[float, ...]]:
    return [tuple(row) for row in array.tolist()]


def assert_same(one: SimplifyResult, other: SimplifyResult) -> None:
    """Assert equality bit for bit."""
    for name in ("vertices", "faces", "vertex_map", "face_map"):
        assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.reached == other.reached
    assert one.messages == other.messages


def may_flip(options: dict[str, Any]) -> bool:
    """Tell whether a refit may flip edges."""
    return options.get("refit", True) and options.get("flips", True) and not {"placement", "preset"} & set(options)


def assert_valid(vertices: Floats, faces: Ints, result: SimplifyResult, *, flips: bool = False) -> None:
    """Assert what holds of every result: types, corners, and maps that agree with the faces where no edge flips."""
    assert (result.vertices.dtype, result.faces.dtype) == (np.float64, np.int32)
    assert (result.vertex_map.dtype, result.face_map.dtype) == (np.int32, np.int32)
    assert result.vertices.shape[1:] == result.faces.shape[1:] == (3,)
    assert np.isfinite(result.vertices).all()
    assert (np.diff(np.sort(result.faces, axis=1), axis=1) > 0).all(), "a face with two equal corners"
    assert_array_equal(np.unique(result.faces), np.arange(len(result.vertices)), "vertices that no face uses")
    assert len(result.face_map) == len(result.faces)
    if not flips:
        assert len(np.unique(result.face_map)) == len(result.faces)
        assert_array_equal(result.vertex_map[faces[result.face_map]], result.faces)
    assert np.isin(result.faces, result.vertex_map).all()
    assert len(result.vertex_map) == len(vertices)
    assert (result.vertex_map >= -1).all()
    loose = np.setdiff1d(np.arange(len(vertices)), faces)
    assert (result.vertex_map[loose] == -1).all() or shared_places(vertices, faces, loose)
    assert isinstance(result.reached, bool)


def shared_places(vertices: Floats, faces: Ints, loose: Ints) -> bool:
    """Tell whether loose vertices may be welded to others."""
    return bool(set(rows(vertices[loose])) & set(rows(vertices[np.unique(faces)])))


@QUICK
@given(SEEDS, st.floats(0.02, 1.0), OPTIONS, st.floats(1.0, 9.0))
def test_needles_and_specks_are_no_hindrance(seed: int, ratio: float, options: dict[str, Any], digits: float) -> None:
    """As Booleans leave them: faces whose squared areas single precision does not hold."""
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.noisy(shapes.torus(16, 20), rng, 0.05)
    for face in faces[rng.choice(len(faces), 60)]:
        corners = face[: rng.integers(2, 4)]  # a needle or a speck
        middle = vertices[corners].mean(axis=0)
        vertices[corners] = middle + (vertices[corners] - middle) * 10.0 ** -rng.uniform(0.5, digits)
    result = simplify(vertices, faces, ratio=ratio, **options)
    assert_valid(vertices, faces, result, flips=may_flip(options))


@QUICK
@given(SEEDS, st.floats(0.02, 1.0), OPTIONS)
@example(233191, 0.15, {"preset": "paper"})
def test_manifolds_reach_the_count_or_say_so(seed: int, ratio: float, options: dict[str, Any]) -> None:
    vertices, faces = shapes.manifold(seed)
    target = max(round(len(faces) * ratio), 1)
    result = simplify(vertices, faces, faces_target=target, **options)
    assert_valid(vertices, faces, result, flips=may_flip(options))
    left = len(result.faces)
    assert result.reached == (left <= target)
    if result.reached:
        # as the papers print it nothing guards the topology: a collapse may take more than two triangles
        before = result.record.left(max(result.record.length_for(target) - 1, 0))
        assert left in (target, target - 1) or (options.get("preset") == "paper" and before > target >= left)
        assert not result.messages
    else:
        assert f"stopped at {left} of {target}" in result.messages[-1]
    used = np.unique(faces)
    assert (result.vertex_map[used] >= 0).all() or options.get("preset") == "paper"
    assert_same(result, simplify(vertices, faces, ratio=ratio, **options))


@QUICK
@given(SEEDS, st.floats(0.02, 1.0), OPTIONS)
def test_anything_gives_a_valid_mesh(seed: int, ratio: float, options: dict[str, Any]) -> None:
    vertices, faces = shapes.anything(seed)
    try:
        result = simplify(vertices, faces, ratio=ratio, **options)
    except MeshError:
        assume(False)
    assert_valid(vertices, faces, result, flips=may_flip(options))
    assert result.reached or result.messages


@QUICK
@given(SEEDS, st.floats(0.1, 1.0), st.sampled_from(METHODS[:1] + METHODS[2:]))
def test_half_edge_collapses_hand_back_input_vertices(seed: int, ratio: float, method: str) -> None:
    vertices, faces = shapes.pinched(seed)
    result = simplify(vertices, faces, ratio=ratio, method=method, placement="endpoint")
    assert set(rows(result.vertices)) <= set(rows(vertices[np.unique(faces)]))
    # a vertex that stays is its own survivor
    for place, vertex in zip(rows(vertices), result.vertex_map.tolist(), strict=True):
        if vertex >= 0 and rows(result.vertices[vertex : vertex + 1])[0] == place:
            break
    else:
        pytest.fail("no vertex stayed")


@QUICK
@given(SEEDS, OPTIONS)
def test_all_faces_kept_is_the_input(seed: int, options: dict[str, Any]) -> None:
    vertices, faces = shapes.manifold(seed)
    result = simplify(vertices, faces, ratio=1.0, **options)
    assert result.reached
    order = np.argsort(result.face_map)
    assert_array_equal(result.face_map[order], np.arange(len(faces)))
    assert_array_equal(result.vertices[result.faces[order]], vertices[faces])
    assert_same(result, simplify(vertices, faces, faces_target=10 * len(faces), **options))


@pytest.mark.parametrize("options", [{"refit": False}, {}, {"placement": "endpoint"}])
def test_levels_of_a_chain_equal_single_runs(options: dict[str, Any]) -> None:
    targets = [1100, 700, 300, 1536, 64, 300]
    chain = lod_chain(*ROUGH, faces_targets=targets, **options)
    for level, target in zip(chain, targets, strict=True):
        assert_same(level, simplify(*ROUGH, faces_target=target, **options))
        assert len(level.faces) in (target, target - 1)
    ratios = [0.5, 0.25, 0.125]
    for level, ratio in zip(lod_chain(*ROUGH, ratios, **options), ratios, strict=True):
        assert_same(level, simplify(*ROUGH, ratio=ratio, **options))


def test_levels_are_nested() -> None:
    fine, coarse = lod_chain(*ROUGH, [0.5, 0.2], refit=False)
    # vertices that are one on the fine level are one on the coarse level
    pairs = np.unique(np.stack((fine.vertex_map, coarse.vertex_map), 1), axis=0)
    assert len(np.unique(pairs[:, 0])) == len(pairs)
    assert set(coarse.face_map.tolist()) <= set(fine.face_map.tolist())


@pytest.mark.parametrize("options", [{}, {"placement": "endpoint"}, {"method": "cf"}])
def test_same_bits_whatever_the_threads(options: dict[str, Any]) -> None:
    mesh = shapes.noisy(shapes.torus(60, 280), np.random.default_rng(0), 0.004)
    one, two = (simplify(*mesh, ratio=0.5, threads=threads, **options) for threads in (1, 2))
    assert_same(one, two)
    assert_array_equal(one.record.position, two.record.position)


@pytest.mark.parametrize("power", [40, -40])
def test_size_changes_no_bit_but_the_exponent(power: int) -> None:
    plain, scaled = simplify(*ROUGH, ratio=0.2), simplify(ROUGH[0] * 2.0**power, ROUGH[1], ratio=0.2)
    assert_array_equal(scaled.faces, plain.faces)
    assert_array_equal(scaled.vertices, plain.vertices * 2.0**power)
    assert_allclose(scaled.error, plain.error * 2.0**power)


@pytest.mark.parametrize(("scale", "offset"), [(1e12, 0), (1e-12, 0), (1.0, 1e6), (1e-3, 1e3), (1e150, 0), (1e-150, 0)])
def test_far_huge_and_tiny_meshes_are_done_as_well(scale: float, offset: float) -> None:
    vertices = ROUGH[0] * scale + offset
    result = simplify(vertices, ROUGH[1], ratio=0.2)
    assert len(result.faces) in (307, 306)
    plain = simplify(*ROUGH, ratio=0.2)
    assert result.error <= 1.5 * plain.error * scale


def test_the_input_is_not_touched() -> None:
    vertices, faces = ROUGH[0].copy(), ROUGH[1].copy()
    simplify(vertices, faces, ratio=0.3)
    assert_array_equal(vertices, ROUGH[0])
    assert_array_equal(faces, ROUGH[1])


@pytest.mark.parametrize("placement", ["optimal", "endpoint"])
def test_closed_shells_stop_short_and_say_so(placement: str) -> None:
    vertices, faces = shapes.many(shapes.ball(1), 300)
    result = simplify(vertices, faces, faces_target=100, placement=placement)
    assert not result.reached
    assert 4 * 300 <= len(result.faces) <= 6 * 300  # a tetrahedron each, or nearly: no face may turn over
    assert f"stopped at {len(result.faces)} of 100 triangles" in result.messages[-1]
    assert "prune" in result.messages[-1]
    assert len(np.unique(vertex_components(result.faces.astype(np.int64), len(result.vertices)))) == 300


def test_open_parts_all_stay() -> None:
    vertices, faces = shapes.many(shapes.sheet(2, 2), 2000)
    result = simplify(vertices, faces, ratio=0.01)
    assert not result.reached
    assert 2000 <= len(result.faces) <= 3000
    assert len(np.unique(vertex_components(result.faces.astype(np.int64), len(result.vertices)))) == 2000


def test_prune_lets_small_parts_go() -> None:
    mesh = shapes.joined(ROUGH, *[(shapes.ball(1)[0] * 0.01, shapes.ball(1)[1])] * 20)
    result = simplify(*mesh, faces_target=60, prune=0.1)
    assert result.reached
    assert len(result.faces) in (60, 59)
    assert (result.vertex_map[len(ROUGH[0]):] == -1).all()
    assert "smaller" in result.messages[0]


@pytest.mark.parametrize("mesh", [shapes.sheet(20, 20, np.random.default_rng(0)), shapes.fan(400), shapes.tube(20, 20)])
def test_flat_sheets_keep_their_outline(mesh: Mesh) -> None:
    result = simplify(*mesh, faces_target=60)
    assert result.reached
    faces = result.faces.astype(np.int64)
    assert len(nonmanifold_edges(faces, len(result.vertices))) == 0
    assert_allclose(outline(result.vertices, faces), outline(*mesh), rtol=0.03)


def outline(vertices: Floats, faces: Ints) -> float:
    """Return the length of the boundary."""
    start, end = boundary_edges(faces, len(vertices)).T
    return float(np.linalg.norm(vertices[start] - vertices[end], axis=1).sum())


def test_a_flat_square_becomes_its_two_triangles() -> None:
    vertices, faces = shapes.sheet(20, 20, np.random.default_rng(0))
    result = simplify(vertices, faces, faces_target=2)
    assert result.reached
    corners = np.round(result.vertices, 3)
    assert_allclose(corners[np.lexsort(corners.T)], [[0, 0, 0], [20, 0, 0], [0, 20, 0], [20, 20, 0]],
                    atol=1e-3)


def seamed(mesh: Mesh, parts: int) -> tuple[Mesh, Ints]:
    patch = np.minimum(np.arange(len(mesh[1])) * parts // len(mesh[1]), parts - 1)
    return shapes.cut_along_seams(mesh, patch), patch


@pytest.mark.parametrize("options", [{"flips": False}, {"refit": False}, {"placement": "endpoint"}])
@pytest.mark.parametrize("parts", [2, 5])
def test_seams_are_handed_back_split_and_closed(parts: int, options: dict[str, Any]) -> None:
    (vertices, faces), patch = seamed(ROUGH, parts)
    result = simplify(vertices, faces, ratio=0.25, **options)
    assert_valid(vertices, faces, result)
    assert len(result.faces) in (384, 383)
    patches = [np.unique(result.faces[patch[result.face_map] == number]) for number in range(parts)]
    assert sum(map(len, patches)) == len(result.vertices), "a vertex in two patches"
    places = np.unique(result.vertices, axis=0, return_inverse=True)[1].ravel()
    assert len(boundary_edges(places[result.faces], len(places))) == 0, "a seam came open"
    assert len(boundary_edges(result.faces.astype(np.int64), len(places))) > 0
    # the weld makes it the same job as the mesh without seams
    whole = simplify(*ROUGH, ratio=0.25, **options)
    assert_array_equal(np.sort(result.face_map), np.sort(whole.face_map))
    at = result.vertices[result.faces[np.argsort(result.face_map)]]
    assert_array_equal(at, whole.vertices[whole.faces[np.argsort(whole.face_map)]])
    apart = simplify(vertices, faces, ratio=0.25, weld=False, **options)
    assert len(boundary_edges(apart.faces.astype(np.int64), len(apart.vertices))) > 0


def test_faces_keep_their_winding() -> None:
    vertices, faces = shapes.noisy(shapes.ball(3), np.random.default_rng(0), 0.01)
    over = np.random.default_rng(1).random(len(faces)) < 0.3
    plain = simplify(vertices, faces, ratio=0.2, flips=False)
    mixed = simplify(vertices, np.where(over[:, None], faces[:, [0, 2, 1]], faces), ratio=0.2, flips=False)
    assert_array_equal(mixed.face_map, plain.face_map)
    turned = over[plain.face_map]
    assert_array_equal(np.sort(mixed.faces, axis=1), np.sort(plain.faces, axis=1))
    assert_valid(vertices, np.where(over[:, None], faces[:, [0, 2, 1]], faces), mixed)
    normals = [np.cross(*(np.diff(r.vertices[r.faces], axis=1).transpose(1, 0, 2))) for r in (plain, mixed)]
    assert_array_equal((normals[0] * normals[1]).sum(axis=1) < 0, turned)


@pytest.mark.parametrize("limit", [0.003, 0.1])
def test_maximum_error_is_kept(limit: float) -> None:
    mesh = shapes.torus(16, 20)
    result = simplify(*mesh, max_error=limit)
    assert result.reached
    assert measure(*mesh, result.vertices, result.faces, seed=1).symmetric.maximum <= limit
    assert result.error <= limit
    assert_valid(*mesh, result, flips=True)


def test_more_error_fewer_faces() -> None:
    mesh = shapes.torus(16, 20)
    counts = [len(level.faces) for level in lod_chain(*mesh, max_errors=[0.0, 0.1, 100.0])]
    assert counts == sorted(counts, reverse=True)
    assert counts[1] < len(mesh[1])
    assert counts[-1] < 40


def test_error_is_what_probes_see_of_the_deviation() -> None:
    result = simplify(*ROUGH, ratio=0.1)
    deviation = measure(*ROUGH, result.vertices, result.faces).symmetric.maximum
    assert 0.7 * deviation <= result.error <= 1.1 * deviation
    assert simplify(*ROUGH, ratio=1.0).error < 1e-12


@pytest.mark.parametrize("targets", [{"ratios": [0.3]}, {"faces_targets": [900, 100]}, {"max_errors": [0.05]}])
def test_progress_rises_from_zero_to_one(targets: dict[str, Any]) -> None:
    yielded, levels = shapes.drained(lod_chain_steps(*ROUGH, **targets))
    assert len(levels) == len(next(iter(targets.values())))
    assert 0 <= yielded[0] < 0.1
    assert yielded[-1] == 1.0
    assert (np.diff(yielded) >= 0).all()
    assert len(yielded) > 5


@pytest.mark.parametrize("steps_done", [0, 1, 2, 5])
def test_may_be_closed_at_any_time_and_leaves_no_threads(steps_done: int) -> None:
    mesh = shapes.torus(100, 170)
    before = set(threading.enumerate())
    steps = simplify_steps(*mesh, ratio=0.1, threads=3)
    for _ in range(steps_done):
        next(steps)
    steps.close()
    assert set(threading.enumerate()) == before
    simplify(*mesh, ratio=0.9, threads=3)
    assert set(threading.enumerate()) == before


def test_refit_improves_the_fit_and_nothing_else() -> None:
    plain, fitted = simplify(*ROUGH, ratio=0.1, refit=False), simplify(*ROUGH, ratio=0.1, flips=False)
    assert_array_equal(plain.faces, fitted.faces)
    assert_array_equal(plain.vertex_map, fitted.vertex_map)
    errors = [measure(*ROUGH, r.vertices, r.faces).symmetric.mean for r in (plain, fitted)]
    assert errors[1] < errors[0]


@pytest.mark.parametrize(("arguments", "words"), [
    ({}, "give one target"),
    ({"ratio": 0.5, "faces_target": 3}, "give one target"),
    ({"ratio": 0.0}, "ratio is .*: give"),
    ({"ratio": -1.0}, "ratio is .*: give"),
    ({"ratio": 1.0001}, "ratio is .*: give"),
    ({"ratio": float("nan")}, "ratio is .*: give"),
    ({"faces_target": 0}, "faces_target is .*: give"),
    ({"faces_target": -5}, "faces_target is .*: give"),
    ({"faces_target": 2.5}, "faces_target is .*: give"),
    ({"max_error": -0.1}, "max_error is .*: give"),
    ({"max_error": float("nan")}, "max_error is .*: give"),
    ({"max_error": float("inf")}, "max_error is .*: give"),
    ({"ratio": 0.5, "method": "best"}, "choose one of"),
    ({"ratio": 0.5, "preset": "best"}, "choose one of"),
    ({"ratio": 0.5, "placement": "middle"}, "choose"),
    ({"ratio": 0.5, "rings": 0}, "rings is 0"),
    ({"ratio": 0.5, "rings": 1.5}, "rings is 1.5"),
    ({"ratio": 0.5, "prune": -1.0}, "prune is -1"),
    ({"ratio": 0.5, "prune": float("nan")}, "prune is nan"),
    ({"ratio": 0.5, "colour": "red"}, "unknown option 'colour'"),
])
def test_requests_without_meaning_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(MeshError, match=words) as caught:
        simplify(*shapes.ball(1), **arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("arguments", [
    {"ratio": "half"},
    {"faces_target": float("nan")},
    {"faces_target": float("inf")},
    {"ratio": 0.5, "share": float("nan")},
    {"ratio": 0.5, "rings": float("nan")},
    {"ratio": 0.5, "rings": None},
    {"ratio": 0.5, "share": 0.0}, {"ratio": 0.5, "flip": 2.0}, {"ratio": 0.5, "memory": -1.0},
    {"ratio": 0.5, "memory": 0.0}, {"ratio": 0.5, "boundary_weight": -1.0}, {"ratio": 0.5, "threads": -1},
    {"ratio": 0.5, "weight_power": float("nan")},
])
def test_odd_requests_are_refused_or_work(arguments: dict[str, Any]) -> None:
    vertices, faces = shapes.noisy(shapes.ball(2), np.random.default_rng(0), 0.05)
    try:
        result = simplify(vertices, faces, **arguments)
    except MeshError:
        return
    assert_valid(vertices, check_mesh(vertices, faces)[1], result)
