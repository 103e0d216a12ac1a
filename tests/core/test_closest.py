# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest points equal a brute-force search over all triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.closest import ClosestPoints

Case = tuple[np.ndarray, np.ndarray, np.ndarray, np.random.Generator]


def squared_to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    length = (along * along).sum(axis=-1)
    at = ((points - a) * along).sum(axis=-1) / np.where(length > 0, length, 1)
    nearest = a + at.clip(0, 1)[..., None] * along
    return ((points - nearest) ** 2).sum(axis=-1)


def brute_force(vertices: np.ndarray, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Squared distance from each point to each triangle: its sides, and its plane where the foot is inside."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    points = points[:, None]
    sides = ((a, b), (b, c), (c, a))
    best = np.min([squared_to_segment(points, *side) for side in sides], axis=0)
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(axis=-1)
    # a sliver's normal is noise; its sides are near enough to all of it
    longest = np.max([((end - start) ** 2).sum(axis=-1) for start, end in sides], axis=0)
    flat = square > 1e-20 * longest**2
    height = ((points - a) * normal).sum(axis=-1)
    foot = points - (height / np.where(flat, square, 1))[..., None] * normal
    inside = flat & np.all([(np.cross(e - s, foot - s) * normal).sum(axis=-1) >= 0 for s, e in sides], axis=0)
    return np.where(inside, np.minimum(best, height**2 / np.where(flat, square, 1)), best)


@st.composite
def meshes(draw: st.DrawFn) -> Case:
    """Draw triangle soup of many kinds: huge beside tiny, slivers, flat, zero area, far from the origin."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count, face_count = draw(st.integers(3, 60)), draw(st.integers(1, 250))
    vertices = rng.normal(size=(count, 3))
    match draw(st.sampled_from(["soup", "flat", "grid", "sizes", "needles", "far"])):
        case "flat":
            vertices[:, draw(st.integers(0, 2))] = 0.5
        case "grid":
            vertices = np.round(vertices)
        case "sizes":
            vertices *= 10.0 ** rng.integers(-4, 3, size=(count, 1))
        case "needles":
            vertices *= [1.0, 1e-6, 1e-7]
        case "far":
            vertices += 1e5
    vertices *= 10.0 ** draw(st.integers(-8, 8))
    faces = rng.integers(0, count, (face_count, 3))
    spread = np.ptp(vertices, axis=0).max() + 1e-12
    offsets = rng.normal(size=(50, 3)) * spread * 10.0 ** rng.integers(-6, 1, (50, 1))
    near = vertices[rng.integers(0, count, 50)] + offsets
    away = vertices.mean(axis=0) + rng.normal(size=(10, 3)) * spread * 1e4
    return vertices, faces, np.concatenate([vertices, near, away]), rng


@settings(max_examples=60, deadline=None)
@given(meshes())
def test_equals_brute_force(case: Case) -> None:
    vertices, faces, points, rng = case
    distances = np.sqrt(brute_force(vertices, faces, points))
    size = np.abs(vertices).max() + np.ptp(vertices, axis=0).max()
    slack = 1e-10 * np.ptp(vertices, axis=0).max() + 1e-14 * (size + np.abs(points).max())
    closest, face, squared = ClosestPoints(vertices, faces).query(points)
    least = distances.min(axis=1)
    assert np.abs(np.sqrt(squared) - least).max() <= slack
    assert np.abs(distances[np.arange(len(points)), face] - least).max() <= slack
    assert np.abs(np.linalg.norm(points - closest, axis=1) - least).max() <= slack
    hinted = ClosestPoints(vertices, faces).query(points, hint=rng.integers(-1, len(faces), len(points)))
    assert np.abs(np.sqrt(hinted[2]) - least).max() <= slack


@settings(max_examples=20, deadline=None)
@given(meshes(), st.floats(0, 1))
def test_max_distance_hides_what_is_farther(case: Case, share: float) -> None:
    vertices, faces, points, _ = case
    search = ClosestPoints(vertices, faces)
    closest, face, squared = search.query(points)
    limit = float(np.quantile(np.sqrt(squared), share)) * 1.0001 + 1e-6 * np.ptp(vertices, axis=0).max()
    near = np.sqrt(squared) < limit * (1 - 1e-9)
    closest_near, face_near, squared_near = search.query(points, max_distance=limit)
    np.testing.assert_allclose(squared_near[near], squared[near], rtol=1e-9)
    hidden = np.sqrt(squared) > limit * (1 + 1e-9)
    assert np.isinf(squared_near[hidden]).all()
    assert np.isnan(closest_near[hidden]).all()
    assert (face_near[hidden] == -1).all()


def test_many_points_on_a_large_surface_are_found_on_it() -> None:
    u, v = np.meshgrid(np.linspace(0, 6, 150), np.linspace(0, 3, 80), indexing="ij")
    vertices = np.column_stack([u.ravel(), v.ravel(), np.sin(3 * u.ravel()) * np.cos(2 * v.ravel())])
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    weights = np.random.default_rng(0).dirichlet(np.ones(3), len(faces))
    points = np.einsum("ij,ijk->ik", weights, vertices[faces])
    _, face, squared = ClosestPoints(vertices, faces).query(points)
    assert squared.max() < 1e-28
    assert (face == np.arange(len(faces))).mean() > 0.99  # the rest lie on an edge


def test_no_points_and_no_faces() -> None:
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    closest, face, squared = ClosestPoints(vertices, faces).query(np.zeros((0, 3)))
    assert closest.shape == (0, 3)
    assert face.shape == squared.shape == (0,)
    with pytest.raises(ValueError, match="no faces"):
        ClosestPoints(vertices, np.zeros((0, 3), dtype=np.int64))


def test_what_is_near_enough_is_not_looked_into() -> None:
    rng = np.random.default_rng(5)
    vertices, faces = rng.normal(size=(60, 3)), rng.integers(0, 60, (200, 3))
    points = rng.normal(size=(3000, 3)) * 2
    search = ClosestPoints(vertices, faces)
    exact = search.query(points)[2]
    for enough in (0.0, 0.3, 1.0, 1e200):
        closest, face, squared = search.query(points, enough=enough)
        far = exact > enough * enough
        np.testing.assert_allclose(squared[far], exact[far], rtol=1e-12)
        assert (squared[~far] >= exact[~far] * (1 - 1e-12)).all()
        assert (squared[~far] <= enough * enough * (1 + 1e-12)).all()
        assert (face >= 0).all()
        assert np.isfinite(closest).all()
