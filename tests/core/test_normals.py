# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals against the cross product face by face."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from eso_addon.core import normals
from eso_addon.core.normals import Floats, Ints

SCALES = [1e-150, 1e-12, 1.0, 1e12, 1e150]


def soup(seed: int = 0, count: int = 200, face_count: int = 20_000) -> tuple[Floats, Ints]:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(count, 3))
    faces = rng.integers(0, count - 1, (face_count, 3))  # the last vertex stays loose
    return vertices, faces


@pytest.mark.parametrize("scale", SCALES)
def test_faces(scale: float) -> None:
    vertices, faces = soup()
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    half = np.cross(b - a, c - a) / 2
    length = np.linalg.norm(half, axis=1)
    flat = length < 1e-15
    close = {"rtol": 1e-9, "atol": 1e-15 * scale**2}
    assert_allclose(normals.face_area_vectors(vertices * scale, faces), half * scale**2, **close)
    assert_allclose(normals.face_areas(vertices * scale, faces), length * scale**2, **close)
    unit = normals.face_normals(vertices * scale, faces)
    assert_allclose(unit[~flat], half[~flat] / length[~flat, None], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("scale", SCALES)
def test_vertices_are_weighted_by_area(scale: float) -> None:
    vertices, faces = soup()
    half = normals.face_area_vectors(vertices, faces)
    sums = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(sums, faces[:, i], half)
    length = np.linalg.norm(sums, axis=1)
    found = normals.vertex_normals(vertices * scale, faces)
    assert_allclose(found[:-1], sums[:-1] / length[:-1, None], rtol=1e-9, atol=1e-9)
    assert found[-1].tolist() == [0, 0, 0]


def test_nothing_to_point_along_gives_zero() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 0, 1]])
    assert not normals.face_normals(vertices, faces).any()
    assert not normals.vertex_normals(vertices, faces).any()
    none = np.zeros((0, 3), dtype=np.int64)
    assert normals.face_normals(vertices, none).shape == (0, 3)
    assert not normals.vertex_normals(vertices, none).any()
