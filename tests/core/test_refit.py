# SPDX-License-Identifier: GPL-3.0-or-later
"""Refit brings a surface nearer to its original and breaks nothing."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.adjacency import boundary_vertices
from eso_addon.core.closest import ClosestPoints
from eso_addon.core.deviation import measure
from eso_addon.core.normals import face_area_vectors
from eso_addon.core.refit import refit

Case = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, bool]


def height_field(
    count: int, height: Callable[[np.ndarray, np.ndarray], np.ndarray], noise: float = 0.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return a grid over the unit square, its inner points moved about, lifted by a function."""
    axis = np.linspace(0, 1, count)
    u, v = (x.ravel() for x in np.meshgrid(axis, axis, indexing="ij"))
    inner = (u > 0) & (u < 1) & (v > 0) & (v < 1)
    shift = np.random.default_rng(seed).uniform(-0.4, 0.4, (2, count * count)) / (count - 1) * noise * inner
    u, v = u + shift[0], v + shift[1]
    index = np.arange(count * count).reshape(count, count)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([u, v, height(u, v)]), faces


def waves(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return 0.15 * np.sin(6 * u) * np.cos(5 * v)


def nearest_vertex(vertices: np.ndarray, original: np.ndarray) -> np.ndarray:
    return ((original[:, None] - vertices) ** 2).sum(axis=2).argmin(axis=1)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Draw a fine wavy sheet and a coarse one that is rough by a random amount."""
    seed, rough = draw(st.integers(0, 2**32 - 1)), draw(st.sampled_from([0.0, 0.01, 0.1, 1.0]))
    original = height_field(draw(st.integers(12, 30)), waves)
    vertices, faces = height_field(draw(st.integers(3, 9)), waves, noise=1.0, seed=seed)
    vertices = vertices + np.random.default_rng(seed).normal(size=vertices.shape) * rough * [0.02, 0.02, 0.1]
    return vertices, faces, *original, draw(st.booleans())


@settings(max_examples=50, deadline=None)
@given(cases())
def test_no_face_flips_held_vertices_stay_and_samples_do_not_get_farther(case: Case) -> None:
    vertices, faces, original, original_faces, guided = case
    fixed = np.arange(len(vertices)) % 5 == 0
    near = nearest_vertex(vertices, original) if guided else None
    moved, _, corner, *_ = refit(vertices, faces, original, original_faces, vertex_map=near, fixed=fixed, flips=False)
    before, after = face_area_vectors(vertices, faces), face_area_vectors(moved, faces)
    assert ((before * after).sum(axis=1) > 0).all()
    assert np.array_equal(corner.ravel(), np.arange(faces.size))
    held = fixed | boundary_vertices(faces, len(vertices))
    assert np.array_equal(moved[held], vertices[held])
    assert np.isfinite(moved).all()
    was = ClosestPoints(vertices, faces).query(original)[2].max()
    assert ClosestPoints(moved, faces).query(original)[2].max() <= was * 1.21 + 1e-12  # not every vertex is a sample
    again, *_ = refit(vertices, faces, original, original_faces, vertex_map=near, fixed=fixed, flips=False)
    assert np.array_equal(again, moved)


@pytest.mark.parametrize("guided", [True, False])
def test_the_mean_falls_on_a_curved_sheet(guided: bool) -> None:
    original, original_faces = height_field(60, waves)
    vertices, faces = height_field(12, waves, noise=1.0)
    near = nearest_vertex(vertices, original) if guided else None
    moved, *_ = refit(vertices, faces, original, original_faces, vertex_map=near)
    before = measure(original, original_faces, vertices, faces, samples=20000).symmetric
    after = measure(original, original_faces, moved, faces, samples=20000).symmetric
    assert after.mean < 0.85 * before.mean
    assert after.maximum <= before.maximum * 1.01


def test_a_plane_stays_a_plane() -> None:
    original, original_faces = height_field(40, lambda u, v: 0.5 * u + 0.25 * v)
    vertices, faces = height_field(8, lambda u, v: 0.5 * u + 0.25 * v, noise=1.0)
    moved, *_ = refit(vertices, faces, original, original_faces)
    assert np.abs(moved[:, 2] - 0.5 * moved[:, 0] - 0.25 * moved[:, 1]).max() < 1e-6


def test_size_and_place_do_not_matter() -> None:
    original, original_faces = height_field(40, waves)
    vertices, faces = height_field(8, waves, noise=1.0)
    moved, *_ = refit(vertices, faces, original, original_faces)
    for scale, shift in ((1e-9, 0.0), (1e9, 0.0), (1.0, 1000.0)):
        other, *_ = refit(vertices * scale + shift, faces, original * scale + shift, original_faces)
        np.testing.assert_allclose((other - shift) / scale, moved, atol=1e-5)


def test_nothing_to_do_changes_nothing() -> None:
    vertices, faces = height_field(5, waves)
    everything = np.ones(len(vertices), dtype=bool)
    assert np.array_equal(refit(vertices, faces, vertices, faces, fixed=everything)[0], vertices)
    assert np.array_equal(refit(vertices, faces, vertices, faces, rounds=0)[0], vertices)
    none = np.zeros((0, 3), dtype=np.int64)
    assert np.array_equal(refit(vertices, none, vertices, faces)[0], vertices)
    assert np.array_equal(refit(vertices, faces, vertices, none)[0], vertices)
