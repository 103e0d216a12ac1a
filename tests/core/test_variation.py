# SPDX-License-Identifier: GPL-3.0-or-later
"""Equations 4 to 8 against a search vertex by vertex, and the cases of the paper's Figures 5 to 7."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from eso_addon.core import rings as ring_pairs
from eso_addon.core.adjacency import unique_edges
from eso_addon.core.mesh import MeshError
from eso_addon.core.normals import Floats, Ints, vertex_normals
from eso_addon.core.variation import angle_defects_and_areas, edge_curvature_factor, vertex_weights


def balls(faces: Ints, count: int, rings: int, hub: int = 10**9) -> list[list[int]]:
    """Return the vertices within so many rings of each vertex, without it, by breadth-first search."""
    near = [set() for _ in range(count)]
    for face in faces.tolist():
        for i in range(3):
            if face[i] != face[i - 1]:
                near[face[i]].add(face[i - 1])
                near[face[i - 1]].add(face[i])
    found = []
    for p in range(count):
        seen, front = {p}, {p}
        for _ in range(rings):
            through = {q for q in front if q == p or len(near[q]) <= hub}
            front = {r for q in through for r in near[q]} - seen
            seen |= front
        found.append(sorted(seen - {p}))
    return found


def reference(vertices: Floats, faces: Ints, rings: int, hub: int = 10**9) -> Floats:
    normals = vertex_normals(vertices, faces)
    weights = np.zeros(len(vertices))
    for p, near in enumerate(balls(faces, len(vertices), rings, hub)):
        way = np.linalg.norm(vertices[near] - vertices[p], axis=1).sum()
        if way > 0.0:
            weights[p] = np.linalg.norm(normals[near] - normals[p], axis=1).sum() / way
    return weights


def grid(side: int, rng: np.random.Generator, bump: float = 0.3) -> tuple[Floats, Ints]:
    """Return a bumpy sheet with diagonals, vertices and faces at random: degrees from 4 to 8 and a boundary."""
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float))
    vertices = np.stack((x, y, bump * rng.normal(size=x.shape)), axis=-1).reshape(-1, 3)
    ids = np.arange(side * side).reshape(side, side)
    a, b, c, d = ids[:-1, :-1].ravel(), ids[:-1, 1:].ravel(), ids[1:, 1:].ravel(), ids[1:, :-1].ravel()
    turned = rng.random(len(a)) < 0.4
    faces = np.concatenate((np.stack((a, b, np.where(turned, d, c)), 1), np.stack((np.where(turned, b, a), c, d), 1)))
    place = rng.permutation(side * side)
    shuffled = np.empty_like(vertices)
    shuffled[place] = vertices
    return shuffled, place[faces[rng.permutation(len(faces))]]


def fan(count: int, height: float) -> tuple[Floats, Ints]:
    """Return a cone of so many faces around vertex 0."""
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    rim = np.stack((np.cos(turn), np.sin(turn), np.zeros(count)), axis=1)
    rim_ids = np.arange(1, count + 1)
    faces = np.stack((np.zeros(count, dtype=np.int64), rim_ids, np.roll(rim_ids, -1)), axis=1)
    return np.concatenate(([[0.0, 0.0, height]], rim)), faces


@pytest.mark.parametrize("rings", [1, 2, 3, 4, 7])
def test_equals_the_search_on_a_sheet(rings: int) -> None:
    vertices, faces = grid(45, np.random.default_rng(rings))  # more vertices than a block
    assert_allclose(vertex_weights(vertices, faces, rings=rings), reference(vertices, faces, rings), rtol=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.integers(3, 300), st.integers(1, 400), st.integers(1, 4))
def test_equals_the_search_on_any_soup(seed: int, count: int, face_count: int, rings: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, 7, (count, 3)).astype(float)  # many at equal places
    faces = rng.integers(0, count, (face_count, 3))
    faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    weights = vertex_weights(vertices, faces, rings=rings)
    assert_allclose(weights, reference(vertices, faces, rings), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("rings", [1, 2, 3])
def test_sets_may_come_in_parts(monkeypatch: pytest.MonkeyPatch, rings: int) -> None:
    monkeypatch.setattr(ring_pairs, "FRAME", 64)
    monkeypatch.setattr(ring_pairs, "MOST_WORDS", 1)
    monkeypatch.setattr(ring_pairs, "LONG_ROW", 5)
    rng = np.random.default_rng(5)
    faces = rng.integers(0, 400, (600, 3))
    faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    vertices = rng.normal(size=(400, 3))
    assert_allclose(vertex_weights(vertices, faces, rings=rings), reference(vertices, faces, rings), rtol=1e-9)


@pytest.mark.parametrize("rings", [1, 2, 3, 4])
def test_no_way_leads_through_a_hub(monkeypatch: pytest.MonkeyPatch, rings: int) -> None:
    vertices, faces = fan(300, 0.5)
    assert_allclose(vertex_weights(vertices, faces, rings=rings), reference(vertices, faces, rings), rtol=1e-9)
    monkeypatch.setattr(ring_pairs, "HUB", 20)
    weights = vertex_weights(vertices, faces, rings=rings)
    assert_allclose(weights, reference(vertices, faces, rings, hub=20), rtol=1e-9)
    # two hubs side by side, and vertices between them
    both = np.concatenate((faces, faces[:, ::-1] * [1, 1, 1] + (faces[:, ::-1] == 0) * 301))
    vertices = np.concatenate((vertices, [[0.0, 0.0, -0.5]]))
    assert_allclose(vertex_weights(vertices, both, rings=rings), reference(vertices, both, rings, hub=20), rtol=1e-9)


def test_a_fan_of_very_many_faces_is_no_trouble() -> None:
    vertices, faces = fan(200_000, 1.0)
    weights = vertex_weights(vertices, faces)
    assert np.isfinite(weights).all()
    assert (weights > 0).all()


def test_zero_on_flat_patches_and_loose_vertices() -> None:
    """The paper's Figures 5 to 7: an edge of three faces, a boundary vertex and two cones, all in one plane."""
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    flat = np.array([[0, 0], [2, 0], [1, 1], [1, -1], [1, 2], [-1, 1], [-1, -1], [9, 9]], dtype=float)
    vertices = np.column_stack((flat, np.zeros(len(flat)))) @ turn + [3.0, -2.0, 5.0]
    three_on_an_edge = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    two_cones = np.array([[0, 1, 2], [0, 5, 6]])
    for faces in (three_on_an_edge, two_cones, three_on_an_edge[:1]):
        for rings in (1, 2, 3):
            assert_allclose(vertex_weights(vertices, faces, rings=rings), 0.0, atol=1e-14)
    vertices[7] = np.nan  # nobody looks at a loose vertex
    assert vertex_weights(vertices, three_on_an_edge)[7] == 0.0


def test_curvature_factor_is_false_where_the_shape_operator_is_not() -> None:
    """A flat square has no curvature; Equations 4 and 5 see some along its boundary, at pinches and at fins."""
    vertices, faces = grid(12, np.random.default_rng(3), bump=0.0)
    defects, areas = angle_defects_and_areas(vertices, faces)
    inside = (vertices[:, :2] > 0).all(axis=1) & (vertices[:, :2] < 11).all(axis=1)
    assert_allclose(defects[inside], 0.0, atol=1e-12)
    assert_allclose(areas.sum(), 3 * 11 * 11)
    edges, _ = unique_edges(faces, len(vertices))
    factor = edge_curvature_factor(defects, areas, edges)
    within = inside[edges].all(axis=1)
    assert_allclose(factor[within], 0.0, atol=1e-12)
    assert (factor[~within] > 0.1).all()
    assert_allclose(vertex_weights(vertices, faces, method="cf")[~inside], np.abs(defects / areas)[~inside])
    assert_allclose(vertex_weights(vertices, faces), 0.0, atol=1e-12)
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    around = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    for more in ([[0, 1, 2]], around.tolist()):  # a third face on edges, and a second cone at the point
        doubled = np.concatenate((around, more))
        assert angle_defects_and_areas(flat, doubled)[0][0] < -1.0
        assert_allclose(vertex_weights(flat, doubled), 0.0, atol=1e-14)


def test_edge_factor_is_equation_five() -> None:
    vertices, faces = fan(6, 1.0)
    defects, areas = angle_defects_and_areas(vertices, faces)
    edges = np.array([[0, 1], [1, 2]])
    a, b = edges.T
    expected = (np.abs(defects[a]) + np.abs(defects[b])) / (areas[a] + areas[b])
    assert_allclose(edge_curvature_factor(defects, areas, edges), expected)
    apex = 2 * np.pi - 6 * 2 * np.arcsin(0.5 / np.sqrt(2))
    assert_allclose(defects[0], apex)


def test_one_ring_is_so_and_qem_is_one() -> None:
    vertices, faces = grid(10, np.random.default_rng(0))
    assert_array_equal(vertex_weights(vertices, faces, method="so"), vertex_weights(vertices, faces, rings=1))
    assert_array_equal(vertex_weights(vertices, faces, method="qem"), np.ones(100))


def test_same_input_same_output_and_inverse_to_scale() -> None:
    vertices, faces = grid(40, np.random.default_rng(8))
    weights = vertex_weights(vertices, faces)
    assert_array_equal(weights, vertex_weights(vertices.copy(), faces.astype(np.int32)))
    for scale in (1e-12, 1e12):
        assert_allclose(vertex_weights(vertices * scale, faces) * scale, weights, rtol=1e-9)


@pytest.mark.parametrize("bad", [{"method": "best"}, {"rings": 0}, {"rings": 1.5}])
def test_bad_requests_say_what_to_do(bad: dict[str, Any]) -> None:
    vertices, faces = fan(5, 1.0)
    with pytest.raises(MeshError, match="choose one of|give a whole number"):
        vertex_weights(vertices, faces, **bad)


def test_bad_meshes() -> None:
    vertices, faces = fan(5, 1.0)
    with pytest.raises(MeshError):
        vertex_weights(vertices, faces + 3)
    assert len(vertex_weights(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))) == 0
    assert vertex_weights(vertices, np.zeros((0, 3), dtype=int)).tolist() == [0.0] * 6
