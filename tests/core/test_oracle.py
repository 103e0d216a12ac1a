# SPDX-License-Identifier: GPL-3.0-or-later
"""The oracle itself: exact on what has an exact answer."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from eso_addon.core.adjacency import Ints
from eso_addon.core.deviation import measure
from eso_addon.core.normals import Floats
from eso_addon.core.variation import vertex_weights

from .oracle import (
    Place,
    endpoint,
    error_at,
    initial_quadrics,
    moved,
    optimal,
    oracle_simplify,
    paper_preset,
    plane_quadrics,
)


def plane_grid(side: int, tilt: tuple[float, float] = (0.3, -0.2)) -> tuple[Floats, Ints]:
    x, y = np.meshgrid(np.arange(side, dtype=float), np.arange(side, dtype=float))
    vertices = np.stack((x, y, tilt[0] * x + tilt[1] * y), axis=-1).reshape(-1, 3)
    ids = np.arange(side * side).reshape(side, side)
    a, b, c, d = ids[:-1, :-1].ravel(), ids[:-1, 1:].ravel(), ids[1:, 1:].ravel(), ids[1:, :-1].ravel()
    return vertices, np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))


def area(vertices: Floats, faces: Ints) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def test_quadrics_measure_squared_distance_to_the_plane() -> None:
    rng = np.random.default_rng(0)
    point, x, origin = rng.normal(size=(3, 3))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    quadric = plane_quadrics(point[None], normal[None])
    assert_allclose(error_at(tuple(quadric[0]), tuple(x)), ((x - point) @ normal) ** 2)
    assert_allclose(error_at(tuple(moved(quadric, origin)[0]), tuple(x - origin)), ((x - point) @ normal) ** 2)


def test_optimal_finds_where_three_planes_meet() -> None:
    rng = np.random.default_rng(1)
    normals = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corner = rng.normal(size=3)
    quadric = tuple(plane_quadrics(np.tile(corner, (3, 1)), normals).sum(axis=0))
    cost, point = optimal(quadric, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert_allclose(point, corner)
    assert cost < 1e-12


@pytest.mark.parametrize("place", [optimal, endpoint])
def test_flat_patch_keeps_its_outline(place: Place) -> None:
    vertices, faces = plane_grid(8)
    result = oracle_simplify(vertices, faces, initial_quadrics(vertices, faces, boundary=1.0), 2, place=place)
    assert len(result.faces) == 2
    assert_allclose(area(result.vertices, result.faces), area(vertices, faces))
    assert max(result.costs) < 1e-12


def test_closed_surface_stops_at_a_tetrahedron() -> None:
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    result = oracle_simplify(vertices, faces, initial_quadrics(vertices, faces), 0)
    assert len(result.faces) == 4
    assert len(result.vertices) == 4


def test_weights_scale_the_costs_of_their_vertices() -> None:
    vertices, faces = plane_grid(4)
    weights = np.linspace(0.5, 2.0, len(vertices))
    plain, weighted = initial_quadrics(vertices, faces), initial_quadrics(vertices, faces, weights=weights, power=2.0)
    assert_allclose(weighted, plain * weights[:, None] ** 2)


def read_obj(path: Path) -> tuple[Floats, Ints]:
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([line[1:4] for line in lines if line and line[0] == "v"], dtype=float)
    faces = np.array(
        [[c.split("/")[0] for c in line[1:4]] for line in lines if line and line[0] == "f"], dtype=np.int64
    )
    return vertices, faces - 1


@pytest.mark.parametrize(("target", "deviation"), [(2321, 0.00442), (580, 0.01234)])
def test_the_paper_again(sample_meshes: Path, target: int, deviation: float) -> None:
    """Tseng and Lin, Table 7: an exact run on the paper's cow, from the simplified mesh to the original."""
    vertices, faces = read_obj(sample_meshes / "cow.obj")
    result = paper_preset(vertices, faces, vertex_weights(vertices, faces), target)
    assert target - 1 <= len(result.faces) <= target
    found = measure(vertices, faces, result.vertices, result.faces, samples=20_000)
    assert_allclose(found.backward.maximum / found.diagonal, deviation, rtol=0.05)
