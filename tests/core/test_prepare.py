# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's mesh is the input's in another order, about the origin: nothing lost, nothing added."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from eso_addon.core.mesh import MeshError, check_mesh
from eso_addon.core.prepare import prepare

from . import shapes
from .shapes import Ints, Mesh

QUICK = settings(max_examples=60, deadline=None)


def first_lowest(faces: Ints) -> Ints:
    """Return faces with their corners turned round until the lowest is first."""
    turn = (np.arange(3) + faces.argmin(axis=1)[:, None]) % 3
    return np.take_along_axis(faces, turn, axis=1)


@QUICK
@given(st.integers(0, 2**32), st.sampled_from([1.0, 1e12, 1e-12]), st.sampled_from([0.0, 1e3]), st.booleans())
def test_every_face_is_there_in_its_place(seed: int, scale: float, offset: float, join: bool) -> None:
    vertices, faces = shapes.anything(seed)
    vertices = (vertices + offset) * scale
    welded = np.unique(vertices, axis=0, return_inverse=True)[1].ravel()[faces] if join else faces
    distinct = (np.diff(np.sort(welded, axis=1), axis=1) > 0).all(axis=1)
    assume(distinct.any())
    _, first = np.unique(first_lowest(welded[distinct]), axis=0, return_index=True)
    mesh = prepare(vertices, faces, join=join)
    assert_array_equal(np.sort(mesh.face), np.sort(np.flatnonzero(distinct)[first]))
    assert ("dropped" in " ".join(mesh.messages)) == (len(mesh.face) < len(faces))
    corners = mesh.faces.T.copy()
    if mesh.turned is not None:
        corners[mesh.turned, 1:] = corners[mesh.turned, :0:-1]
    assert_array_equal(corners, mesh.vertex[faces[mesh.face]])
    assert_allclose(mesh.points.T * mesh.size + mesh.center, vertices[mesh.source], rtol=0, atol=1e-15 * scale * 1e4)
    assert_array_equal(vertices[mesh.source][corners], vertices[faces[mesh.face]])


@QUICK
@given(st.integers(0, 2**32), st.sampled_from([1.0, 1e150, 1e12, 1e-12, 1e-150]))
def test_the_engine_sees_unit_size_about_the_origin(seed: int, scale: float) -> None:
    vertices, faces = shapes.manifold(seed)
    mesh = prepare(vertices * scale, faces)
    low, high = mesh.points.min(axis=1), mesh.points.max(axis=1)
    assert_allclose(np.linalg.norm(high - low), 1.0)
    assert_allclose(low, -high, atol=1e-12)
    assert_array_equal(np.sort(mesh.source), np.unique(faces))
    assert_array_equal(np.unique(mesh.faces), np.arange(len(mesh.source)))
    assert (mesh.vertex[np.setdiff1d(np.arange(len(vertices)), faces)] == -1).all()
    assert_array_equal(mesh.vertex[mesh.source], np.arange(len(mesh.source)))


def cut(mesh: Mesh) -> Mesh:
    return shapes.cut_along_seams(mesh, (mesh[0][mesh[1]].mean(axis=1)[:, 0] > 0).astype(np.int64))


def test_seams_are_closed_and_their_sides_told_apart() -> None:
    vertices, faces = cut(shapes.ball(2))
    assert not prepare(*shapes.ball(2)).opened.any()
    mesh = prepare(vertices, faces)
    assert not mesh.opened.any()
    assert len(mesh.source) == len(shapes.ball(2)[0])
    assert mesh.sheet is not None
    assert len(np.unique(mesh.sheet)) == 2
    apart = prepare(vertices, faces, join=False)
    assert apart.sheet is None
    assert apart.opened.any()


def test_windings_at_odds_are_mended() -> None:
    vertices, faces = shapes.turned(shapes.ball(2), np.random.default_rng(0), 0.3)
    mesh = prepare(vertices, faces)
    assert mesh.turned is not None
    assert not mesh.opened.any()


def test_prune_drops_small_parts_alone() -> None:
    vertices, faces = shapes.joined(shapes.ball(2), (shapes.ball(1)[0] * 0.1, shapes.ball(1)[1]), shapes.sheet(3, 3))
    mesh = prepare(vertices, faces, prune=0.5)
    assert_array_equal(np.sort(mesh.face), np.concatenate((np.arange(128), np.arange(160, 178))))
    assert any("smaller" in message for message in mesh.messages)
    assert len(prepare(vertices, faces, prune=0.34).face) == len(faces)  # the diagonal is 0.346
    with pytest.raises(MeshError):
        prepare(vertices, faces, prune=100.0)


def test_repeated_and_flat_faces_go_but_a_second_side_stays() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    faces = np.array([[0, 1, 2], [1, 3, 2], [2, 0, 1], [1, 1, 2], [0, 2, 1]])
    mesh = prepare(*check_mesh(vertices, faces))
    assert_array_equal(np.sort(mesh.face), [0, 1, 4])
    assert mesh.messages[0].startswith("2 faces")


@pytest.mark.parametrize("faces", [np.zeros((0, 3), np.int64), np.array([[0, 0, 1]]), np.array([[0, 1, 2]])])
def test_nothing_to_simplify(faces: Ints) -> None:
    with pytest.raises(MeshError, match="nothing to simplify"):
        prepare(np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0]], float), faces)


def test_coordinates_too_large() -> None:
    vertices, faces = shapes.ball(1)
    with pytest.raises(MeshError, match="scale the mesh down"):
        prepare(vertices * 1.7e308, faces)
