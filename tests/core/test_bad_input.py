# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad meshes at the Python API: each works, or is refused with one line that says what to do."""

from __future__ import annotations

import numpy as np
import pytest

import eso_addon
from eso_addon.core.adjacency import nonmanifold_edges, vertex_components
from eso_addon.core.mesh import MeshError
from eso_addon.core.simplify import SimplifyResult, simplify

from . import shapes
from .shapes import Mesh

BALL = shapes.noisy(shapes.ball(3), np.random.default_rng(0), 0.01)
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), np.array([[0, 1, 2]])
BOTH = pytest.mark.parametrize("placement", ["optimal", "endpoint"])


def with_coordinate(value: float) -> Mesh:
    vertices = BALL[0].copy()
    vertices[BALL[1][17, 1], 2] = value
    return vertices, BALL[1]


def with_corner(value: int) -> Mesh:
    faces = BALL[1].copy()
    faces[17, 1] = value
    return BALL[0], faces


@pytest.mark.parametrize(("mesh", "words"), [
    ((np.zeros((0, 3)), np.zeros((0, 3), np.int64)), "no faces"),
    (([], []), "no faces"),
    ((BALL[0], np.zeros((0, 3), np.int64)), "no faces"),
    ((TRIANGLE[0], [[0, 0, 1], [2, 2, 2]]), "no face with three distinct corners"),
    ((np.zeros((3, 3)), [[0, 1, 2]]), "no face with three distinct corners"),
    (with_coordinate(np.nan), "not finite.*delete or mend"),
    (with_coordinate(np.inf), "not finite.*delete or mend"),
    (with_coordinate(-np.inf), "not finite.*delete or mend"),
    (with_corner(-1), "face 17 .*repair"),
    (with_corner(len(BALL[0])), "face 17 .*repair"),
    (with_corner(2**62), "face 17 .*repair"),
    ((BALL[0], BALL[1].astype(float)), "integers"),
    ((BALL[0][:, :2], BALL[1]), "vertices must be"),
    ((BALL[0], BALL[1][:, :2]), "triangulate"),
])
def test_refused_with_what_to_do(mesh: Mesh, words: str) -> None:
    for call in (lambda: eso_addon.simplify(*mesh, ratio=0.5), lambda: eso_addon.lod_chain(*mesh, [0.5, 0.2])):
        with pytest.raises(eso_addon.MeshError, match=words) as caught:
            call()
        assert "\n" not in str(caught.value)


def assert_works(mesh: Mesh, result: SimplifyResult) -> None:
    assert np.isfinite(result.vertices).all()
    assert (np.diff(np.sort(result.faces, axis=1), axis=1) > 0).all()
    assert result.faces.max() == len(result.vertices) - 1
    assert result.reached or "stopped" in result.messages[-1]
    assert len(result.vertex_map) == len(mesh[0])
    assert result.face_map.max() < len(mesh[1])


@BOTH
def test_one_triangle_stays(placement: str) -> None:
    result = simplify(*TRIANGLE, faces_target=1, placement=placement)
    assert result.reached
    assert len(result.faces) == 1
    assert sorted(result.vertices.tolist()) == sorted(TRIANGLE[0].tolist())


@BOTH
def test_two_triangles_and_a_tetrahedron(placement: str) -> None:
    result = simplify(*shapes.sheet(1, 1), faces_target=1, placement=placement)
    assert len(result.faces) in (1, 2)
    result = simplify(*shapes.tetrahedron(), faces_target=1, placement=placement)
    assert len(result.faces) == 4
    assert not result.reached


@BOTH
def test_loose_points_do_not_matter(placement: str) -> None:
    loose = np.array([[9, 9, 9], [np.nan, 0, 0], [np.inf, 0, 0]], float)
    vertices, faces = np.concatenate((loose, BALL[0])), BALL[1] + 3
    result = simplify(vertices, faces, ratio=0.2, placement=placement)
    assert (result.vertex_map[:3] == -1).all()
    plain = simplify(*BALL, ratio=0.2, placement=placement)
    assert np.array_equal(result.vertices, plain.vertices)
    assert np.array_equal(result.vertex_map[3:], plain.vertex_map)
    assert np.isfinite(result.error)


@BOTH
def test_flat_and_repeated_faces_are_dropped_and_counted(placement: str) -> None:
    faces = np.concatenate((BALL[1], BALL[1][:7], np.roll(BALL[1][:3], 1, axis=1), [[4, 4, 9], [5, 5, 5]]))
    result = simplify(BALL[0], faces, ratio=0.2, placement=placement)
    assert_works((BALL[0], faces), result)
    assert result.messages == ("12 faces without area or repeated were dropped",)
    assert len(result.faces) <= round(len(faces) * 0.2)


@BOTH
def test_faces_of_no_area_with_three_corners(placement: str) -> None:
    vertices, faces = shapes.sheet(6, 6)
    vertices[:, 1] = 0.0  # all in one line
    assert_works((vertices, faces), simplify(vertices, faces, ratio=0.3, placement=placement, weld=False))
    assert_works((vertices, faces), simplify(vertices * [1, 1, 0] + np.random.default_rng(0).normal(size=(49, 1)),
                                             faces, ratio=0.3, placement=placement))


@BOTH
@pytest.mark.parametrize("scale", [1e12, 1e-12, 1e100, 1e-100])
def test_huge_and_tiny(scale: float, placement: str) -> None:
    result = simplify(BALL[0] * scale, BALL[1], ratio=0.1, placement=placement)
    assert_works(BALL, result)
    assert len(result.faces) in (51, 50)
    assert 0.5 * scale < np.abs(result.vertices).max() < 2 * scale
    assert result.error < 0.3 * scale


@BOTH
def test_small_beside_far_away(placement: str) -> None:
    mesh = shapes.joined(BALL, BALL, gap=1e12)
    assert_works(mesh, simplify(*mesh, ratio=0.1, placement=placement))


@BOTH
@pytest.mark.parametrize("mesh", [
    shapes.finned(BALL, 40),
    (BALL[0], np.concatenate((BALL[1], BALL[1][:, ::-1]))),
    shapes.touching(BALL, shapes.sheet(8, 8)),
    shapes.touching(shapes.fan(20), shapes.fan(20)),
    shapes.mobius(40, 3),
    shapes.mobius(400),
    shapes.mobius(3),
    shapes.turned(BALL, np.random.default_rng(0)),
    shapes.holed(BALL, np.random.default_rng(0), 0.3),
    shapes.soup(np.random.default_rng(0), 60, 300),
    (BALL[0], BALL[1][::2]),
    shapes.double_cone(2000),
    shapes.many(TRIANGLE, 1000),
    shapes.many(shapes.tetrahedron(), 1000),
], ids=["fins", "two sides", "ball on sheet", "bow tie", "mobius", "thin mobius", "least mobius", "windings", "holes",
        "soup", "loose faces", "high valence", "triangles", "tetrahedra"])
def test_shapes_that_are_not_manifold(mesh: Mesh, placement: str) -> None:
    result = simplify(*mesh, ratio=0.25, placement=placement)
    assert_works(mesh, result)


@pytest.mark.parametrize("mesh", [shapes.mobius(40, 3), shapes.touching(BALL, shapes.sheet(8, 8))])
def test_no_new_place_that_is_not_manifold(mesh: Mesh) -> None:
    result = simplify(*mesh, ratio=0.25)
    assert len(nonmanifold_edges(result.faces.astype(np.int64), len(result.vertices))) == 0
    parts = vertex_components(result.faces.astype(np.int64), len(result.vertices))
    assert parts.max() == 0


@BOTH
@pytest.mark.parametrize("more", [0, 1, 10**12])
def test_a_count_above_the_inputs_gives_the_input(more: int, placement: str) -> None:
    result = simplify(*BALL, faces_target=len(BALL[1]) + more, placement=placement)
    assert result.reached
    assert len(result.faces) == len(BALL[1])
    assert {tuple(p) for p in result.vertices.tolist()} == {tuple(p) for p in BALL[0].tolist()}


@pytest.mark.parametrize("ratio", [0, -0.5, 1.5, float("nan"), float("inf")])
def test_a_ratio_that_is_none(ratio: float) -> None:
    with pytest.raises(MeshError, match="ratio is .*: give a number"):
        simplify(*BALL, ratio=ratio)


def test_measure_and_weights_say_it_too() -> None:
    bad = with_coordinate(np.nan)
    with pytest.raises(MeshError, match="not finite"):
        eso_addon.measure(*BALL, *bad)
    with pytest.raises(MeshError, match="not finite"):
        eso_addon.vertex_weights(*bad)
    with pytest.raises(MeshError):
        eso_addon.measure(*BALL, BALL[0], np.zeros((0, 3), np.int64))
