# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that come back: the mesh stays closed and wound one way, maps hold, and the surface comes nearer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from eso_addon.core.adjacency import face_neighbors
from eso_addon.core.attributes import Attribute
from eso_addon.core.deviation import measure
from eso_addon.core.reinsertion import reinsert, spare_vertices
from eso_addon.core.simplify import lod_chain, simplify

from . import shapes
from .test_simplify import QUICK, SEEDS

TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def sides(faces: np.ndarray) -> set:
    return {(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}


@pytest.mark.parametrize("weights", [[0.3, 0.3, 0.4], [0.02, 0.5, 0.48], [0.5, 0.02, 0.48], [0.45, 0.5, 0.05]])
@pytest.mark.parametrize("face", range(4))
def test_a_face_or_a_side_is_split(face: int, weights: list[float]) -> None:
    corners = TETRAHEDRON[FACES[face]]
    point = np.array(weights) @ corners
    out = point - TETRAHEDRON.mean(axis=0)
    point += 0.1 * out
    made = reinsert(TETRAHEDRON, FACES, face_neighbors(FACES, 4), point[:, None], np.array([0.01]), np.array([face]),
                    np.array(weights)[:, None], 1, np.ones((3, 4), bool))
    assert len(made.faces) == 6
    assert sides(made.faces) == {(b, a) for a, b in sides(made.faces)}
    assert len(sides(made.faces)) == 18
    old = made.faces < 4
    assert_array_equal(FACES.ravel()[made.corner][old], made.faces[old])
    assert (made.corner // 3 == made.corner[:, :1] // 3).all()
    whole = (made.faces[:4] < 4).all(axis=1)
    assert_array_equal(made.faces[:4][whole], FACES[whole])
    assert whole.sum() == (3 if min(weights) >= 0.1 else 2)


@QUICK
@given(SEEDS, st.floats(0.3, 0.8))
def test_levels_with_vertices_put_back_are_manifold_and_mapped(seed: int, ratio: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.holed(shapes.noisy(shapes.torus(24, 32), rng, 0.02), rng, 0.05)
    result = simplify(vertices, faces, ratio=ratio)
    each = np.concatenate([result.faces[:, [0, 1]], result.faces[:, [1, 2]], result.faces[:, [2, 0]]])
    assert len(np.unique(each, axis=0)) == len(each), "a side twice"
    assert result.vertex_map.max() == len(result.vertices) - 1
    assert np.isin(np.arange(len(result.vertices)), result.vertex_map).all()
    assert not result.reached or len(result.faces) in (round(ratio * len(faces)), round(ratio * len(faces)) - 1)


def spiked() -> tuple[np.ndarray, np.ndarray]:
    """Return a fine, rough grid with lone vertices that stick out."""
    vertices, faces = shapes.sheet(40, 40)
    vertices = vertices.copy()
    vertices[:, 2] += np.random.default_rng(0).normal(0, 0.1, len(vertices))
    vertices[np.arange(205, len(vertices), 171), 2] += 2
    return vertices, faces


def test_the_maximum_falls_where_lone_vertices_stick_out() -> None:
    vertices, faces = spiked()
    fitted, plain = (simplify(vertices, faces, ratio=0.3, flips=flips) for flips in (True, False))
    far = [measure(vertices, faces, result.vertices, result.faces, samples=20_000, seed=0).symmetric.maximum
           for result in (fitted, plain)]
    assert far[0] <= far[1]


def test_attributes_come_back_with_their_vertices() -> None:
    vertices, faces = spiked()
    values = np.arange(len(vertices), dtype=np.float32)
    result = simplify(vertices, faces, ratio=0.3, attributes={
        "number": Attribute(values, "vertex"), "place": Attribute(vertices[faces].reshape(-1, 3), "corner"),
        "part": Attribute(np.arange(len(faces)), "face")})
    assert len(result.attributes["part"]) == len(result.faces)
    assert_array_equal(result.attributes["part"], result.face_map)
    here = result.vertices[result.faces].reshape(-1, 3)
    # exact but for the heights that the refit levels out
    assert np.abs(here - result.attributes["place"])[:, :2].max() < 0.2
    assert np.abs(here - result.attributes["place"])[:, 2].max() < 2


def test_chains_have_the_counts_that_were_asked() -> None:
    vertices, faces = spiked()
    targets = [2000, 1001, 400, 399, 200, 199]
    for level, target in zip(lod_chain(vertices, faces, faces_targets=targets), targets, strict=True):
        assert len(level.faces) in (target, target - 1)
        assert spare_vertices(target) == target // 100


@QUICK
@given(SEEDS)
def test_what_is_carried_changes_no_face(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.holed(shapes.noisy(shapes.torus(24, 32), rng, 0.03), rng, 0.05)
    plain = simplify(vertices, faces, ratio=0.4)
    result = simplify(vertices, faces, ratio=0.4, attributes={"weight": Attribute(rng.random(len(vertices)), "vertex")})
    for name in ("vertices", "faces", "vertex_map", "face_map"):
        assert_array_equal(getattr(result, name), getattr(plain, name), name)
