# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadrics against the textbook: 4 by 4 matrices of planes (Equations 1 to 3 and 9)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from eso_addon.core.adjacency import unique_edges
from eso_addon.core.manifold import boundary_sides, open_vertices
from eso_addon.core.quadrics import (
    anchored,
    area_normals,
    boundary_quadrics,
    cross,
    endpoint_costs,
    errors_at,
    move_memory,
    optimal_costs,
    optimal_places,
    plane_quadrics,
)

from . import shapes
from .shapes import Floats, Ints

QUICK = settings(max_examples=40, deadline=None)


def plane(normal: Floats, point: Floats) -> Floats:
    p = np.append(normal, -normal @ point)
    return np.outer(p, p)


def textbook(vertices: Floats, faces: Ints, *, area_weighted: bool = False, boundary: float = 0.0) -> Floats:
    """Return the sum of K_p at each vertex, (n, 4, 4), from scratch."""
    total = np.zeros((len(vertices), 4, 4))
    shared: dict[frozenset[int], int] = {}
    for face in faces.tolist():
        for i in range(3):
            side = frozenset((face[i - 1], face[i]))
            shared[side] = shared.get(side, 0) + 1
    for face in faces.tolist():
        a, b, c = vertices[face]
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal) / 2
        if area == 0.0:
            continue
        normal /= 2 * area
        for corner in face:
            total[corner] += plane(normal, a) * (area if area_weighted else 1.0)
        for u, v in ((face[i - 1], face[i]) for i in range(3)):
            if boundary > 0 and shared[frozenset((u, v))] == 1:
                along = vertices[v] - vertices[u]
                length = np.linalg.norm(along)
                wall = boundary * length**2 * plane(np.cross(along / length, normal), vertices[u])
                total[u] += wall
                total[v] += wall
    return total


def matrices(rows: Floats) -> Floats:
    """Return the engine's rows as 4 by 4 matrices."""
    a11, a12, a13, a22, a23, a33, b1, b2, b3, c = rows.T[:10]
    return np.array([[a11, a12, a13, b1], [a12, a22, a23, b2], [a13, a23, a33, b3], [b1, b2, b3, c]]).transpose(2, 0, 1)


def engine_quadrics(vertices: Floats, faces: Ints, *, area_weighted: bool, boundary: float, memory: float) -> Floats:
    points, corners = vertices.T.copy(), faces.T.copy()
    normals, areas = area_normals(points, corners)
    parts = plane_quadrics(corners, normals, areas, len(vertices), area_weighted=area_weighted)
    if boundary > 0:
        sides = boundary_sides(corners, open_vertices(corners, len(vertices)))
        face = sides % len(faces)
        edges = np.stack((corners.ravel()[sides], np.roll(corners, -1, axis=0).ravel()[sides]))
        parts += boundary_quadrics(points, normals[:, face] / areas[face], edges, boundary)
    return anchored(parts, points, memory)


@QUICK
@given(st.integers(0, 2**32), st.booleans(), st.sampled_from([0.0, 1.0, 3.5]))
def test_sum_of_planes(seed: int, area_weighted: bool, boundary: float) -> None:
    vertices, faces = shapes.manifold(seed)
    rows = engine_quadrics(vertices, faces, area_weighted=area_weighted, boundary=boundary, memory=0.0)
    expected = textbook(vertices, faces, area_weighted=area_weighted, boundary=boundary)
    assert_allclose(matrices(rows), expected, atol=1e-9 * max(np.abs(expected).max(), 1e-9))
    assert (rows[:, 10:] == 0).all()


@QUICK
@given(st.integers(0, 2**32))
def test_error_is_the_quadratic_form(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.manifold(seed)
    rows = engine_quadrics(vertices, faces, area_weighted=True, boundary=1.0, memory=1e-3)
    places = rng.normal(size=(3, len(rows)))
    homogeneous = np.concatenate((places, np.ones((1, len(rows)))))
    expected = np.einsum("in,nij,jn->n", homogeneous, matrices(rows), homogeneous)
    assert_allclose(errors_at(rows, places), expected, rtol=1e-9, atol=1e-9)
    at_home = errors_at(rows, vertices.T)
    assert_allclose(at_home, 0.0, atol=1e-12 * max(np.abs(rows).max(), 1.0))


@QUICK
@given(st.integers(0, 2**32), st.sampled_from([1e-3, 1e-7]))
def test_optimal_place_is_where_the_gradient_vanishes(seed: int, memory: float) -> None:
    vertices, faces = shapes.manifold(seed)
    rows = engine_quadrics(vertices, faces, area_weighted=True, boundary=1.0, memory=memory)
    edges, _ = unique_edges(faces, len(vertices))
    summed = rows[edges[:, 0]] + rows[edges[:, 1]]
    places = optimal_places(summed)
    quadric = matrices(summed)
    gradient = np.einsum("nij,jn->ni", quadric[:, :3, :3], places) + quadric[:, :3, 3]
    assert_allclose(gradient, 0.0, atol=1e-9 * np.abs(summed).max())
    least = errors_at(summed, places)
    scale = np.abs(summed).max()
    for step in np.random.default_rng(seed).normal(size=(5, 3, 1)) * 0.1:
        assert (errors_at(summed, places + step) >= least - 1e-12 * scale).all()
    assert_allclose(optimal_costs(rows, edges[:, 0], edges[:, 1]), np.maximum(least, 0), rtol=1e-5, atol=1e-12 * scale)
    at_one, at_other = endpoint_costs(rows, np.column_stack((vertices, vertices[:, 0])), edges[:, 0], edges[:, 1])
    assert_allclose(at_one, errors_at(summed, vertices[edges[:, 0]].T), rtol=1e-5, atol=1e-12 * scale)
    assert_allclose(at_other, errors_at(summed, vertices[edges[:, 1]].T), rtol=1e-5, atol=1e-12 * scale)


def test_three_planes_meet_in_their_corner() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]])
    rows = engine_quadrics(vertices, faces, area_weighted=False, boundary=0.0, memory=1e-12)
    assert_allclose(optimal_places(rows[[0]] + rows[[1]])[:, 0], 0.0, atol=1e-9)


def test_memory_alone_holds_a_flat_patch_where_it_stands() -> None:
    """On a plane the sum of two memories is least in the middle, and dearer for longer edges."""
    vertices, faces = shapes.sheet(4, 6)
    vertices[:, 0] *= 3.0
    rows = engine_quadrics(vertices, faces, area_weighted=False, boundary=0.0, memory=1e-4)
    middle = np.array([15, 16])  # six faces each
    summed = rows[middle] + rows[[16, 17]]
    assert_allclose(optimal_places(summed).T, (vertices[middle] + vertices[[16, 17]]) / 2, atol=1e-9)
    across, along = optimal_costs(rows, np.array([15, 15]), np.array([16, 22]))
    assert_allclose(across / along, 9.0, rtol=1e-5)


@QUICK
@given(st.integers(0, 2**32), st.sampled_from([1e-2, 1e-5]))
def test_memory_moves_with_the_vertex(seed: int, memory: float) -> None:
    """The merged quadric is the sum of the planes, and remembers the new place alone."""
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.manifold(seed)
    plain = engine_quadrics(vertices, faces, area_weighted=True, boundary=1.0, memory=0.0)
    held = engine_quadrics(vertices, faces, area_weighted=True, boundary=1.0, memory=memory)
    edges, _ = unique_edges(faces, len(vertices))
    one, other = edges.T
    places = rng.normal(size=(3, len(edges)))
    merged = held[one] + held[other]
    move_memory(merged, held[one], held[other], vertices[one].T, vertices[other].T, places, memory)
    trace = (plain[one] + plain[other])[:, [0, 3, 5]].sum(axis=1)
    at = rng.normal(size=(3, len(edges)))
    expected = errors_at(plain[one] + plain[other], at) + memory * trace * ((at - places) ** 2).sum(axis=0)
    assert_allclose(errors_at(merged, at), expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("area_weighted", [True, False])
def test_faces_without_area_weigh_nothing(area_weighted: bool) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float)
    corners = np.array([[0], [1], [2]])
    rows = plane_quadrics(corners, *area_normals(vertices.T.copy(), corners), 3, area_weighted=area_weighted)
    assert_array_equal(rows, 0.0)
    held = anchored(rows, vertices.T.copy(), 1e-7)
    assert np.isfinite(optimal_places(held)).all()  # solvable all the same


def test_cross_product() -> None:
    a, b = np.random.default_rng(0).normal(size=(2, 3, 9))
    assert_allclose(np.array(cross(a, b)), np.cross(a, b, axis=0))
