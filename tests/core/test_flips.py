# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges flip where that brings the surface nearer, and the mesh stays the mesh that it was in all else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.adjacency import unique_edges
from eso_addon.core.closest import ClosestPoints
from eso_addon.core.deviation import measure
from eso_addon.core.flips import flip_edges
from eso_addon.core.refit import refit
from eso_addon.core.simplify import simplify

from . import shapes
from .test_refit import Case, cases, nearest_vertex


def refitted(case: Case, **options: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces, original, original_faces, guided = case
    near = nearest_vertex(vertices, original) if guided else None
    moved, _, corner, *_ = refit(vertices, faces, original, original_faces, vertex_map=near, **options)  # type: ignore[arg-type]
    return moved, faces.ravel().take(corner), corner


@settings(max_examples=50, deadline=None)
@given(cases())
def test_the_mesh_stays_a_sheet_with_the_same_rim(case: Case) -> None:
    vertices, faces, original, _, _ = case
    moved, flipped, _ = refitted(case)
    before, after = unique_edges(faces, len(vertices)), unique_edges(flipped, len(vertices))
    assert len(before[0]) == len(after[0])
    assert after[1].max() == 2
    assert np.array_equal(before[0][before[1] == 1], after[0][after[1] == 1])
    sides = np.stack((flipped, np.roll(flipped, -1, axis=1)), axis=-1).reshape(-1, 2)
    assert len(np.unique(sides, axis=0)) == len(sides)  # neighbours are wound against each other
    assert np.array_equal(np.unique(flipped), np.unique(faces))
    was = ClosestPoints(vertices, faces).query(original)[2].max()
    assert ClosestPoints(moved, flipped).query(original)[2].max() <= was * 1.21 + 1e-12  # not every vertex is a sample
    assert np.array_equal(refitted(case)[1], flipped)


@settings(max_examples=30, deadline=None)
@given(cases())
def test_what_is_bound_or_parted_stays(case: Case) -> None:
    faces = case[1]
    assert np.array_equal(refitted(case, bound=np.ones(len(case[0]), bool))[1], faces)
    assert np.array_equal(refitted(case, group=np.arange(len(faces)))[1], faces)
    half = np.arange(len(faces)) % 2
    _, flipped, corner = refitted(case, group=half)
    assert np.array_equal(half[corner // 3], np.repeat(half[:, None], 3, axis=1))
    assert flipped.shape == faces.shape


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_on_any_mesh_the_topology_is_that_of_the_collapses(seed: int) -> None:
    vertices, faces = shapes.anything(seed)
    levels = [simplify(vertices, faces, ratio=0.4, flips=flips) for flips in (True, False)]
    assert shapes.topology(levels[0].faces) == shapes.topology(levels[1].faces)
    assert len(levels[0].vertices) == len(levels[1].vertices)


def test_a_wrong_diagonal_is_turned_into_the_ridge() -> None:
    axis = np.linspace(0, 1, 21)
    u, v = (x.ravel() for x in np.meshgrid(axis, axis, indexing="ij"))
    index = np.arange(21 * 21).reshape(21, 21)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    original = np.column_stack([u, v, np.abs(u - v)])
    fine = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    corners = np.array([[0.0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]])
    moved, _, corner, *_ = refit(corners, np.array([[0, 1, 3], [1, 2, 3]]), original, fine)
    faces = np.array([[0, 1, 3], [1, 2, 3]]).ravel().take(corner)
    assert {frozenset(face) for face in faces.tolist()} == {frozenset((0, 1, 2)), frozenset((0, 2, 3))}
    assert measure(original, fine, moved, faces, samples=1000).symmetric.maximum < 1e-6


@given(st.integers(0, 10_000))
def test_only_edges_beside_the_asked_faces_flip(seed: int) -> None:
    random = np.random.default_rng(seed)
    vertices, faces = shapes.noisy(shapes.ball(2), random, 0.1)
    points = vertices[faces].mean(axis=1).T + random.normal(0, 0.05, (3, len(faces)))
    among = random.random(len(faces)) < 0.2
    corner, _ = flip_edges(vertices, faces, points.astype(np.float32), np.zeros_like(points), np.ones(len(faces)),
                           np.arange(len(faces)), np.full(len(faces), 0.01), among=among)
    changed = (corner != np.arange(faces.size).reshape(faces.shape)).any(axis=1)
    # a flip changes two faces, of which one at least was asked for
    assert among[changed].sum() * 2 >= changed.sum()


def test_flips_bring_a_level_nearer_and_keep_its_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    # without vertices that come back, which levels of flips alone get, both take the same collapses
    monkeypatch.setattr("eso_addon.core.levels.spare_vertices", lambda triangles: 0)
    vertices, faces = shapes.noisy(shapes.ball(4), np.random.default_rng(3), 0.02)
    levels = [simplify(vertices, faces, ratio=0.05, flips=flips) for flips in (True, False)]
    mean, plain = (measure(vertices, faces, level.vertices, level.faces, samples=20000).symmetric.mean
                   for level in levels)
    assert mean < plain
    assert np.array_equal(levels[0].vertex_map, levels[1].vertex_map)
    assert np.array_equal(levels[0].face_map, levels[1].face_map)
    assert len(levels[0].faces) == len(levels[1].faces)
