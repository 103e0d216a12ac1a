# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetric meshes stay symmetric, closed, and keep what each side carries."""

import numpy as np
import pytest

from eso_addon.core.mesh import MeshError
from eso_addon.core.simplify import simplify
from tests.core.shapes import ball, torus


def images(points: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Give points and their mirror images in the same order."""
    other = points * np.where(np.arange(3) == axis, -1, 1)
    return tuple(rows[np.lexsort(rows.round(9).T)] for rows in (points, other))


def open_sides(faces: np.ndarray) -> int:
    sides = np.sort(np.concatenate((faces[:, :2], faces[:, 1:], faces[:, ::2])), axis=1)
    return int((np.unique(sides, axis=0, return_counts=True)[1] != 2).sum())


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("ratio", [0.5, 0.1])
@pytest.mark.parametrize("shape", ["ball", "torus", "no edge in the plane"])
def test_the_result_is_its_own_image(axis: str, ratio: float, shape: str) -> None:
    vertices, faces = torus(24, 24) if shape == "torus" else ball(4)
    if shape != "ball":
        turn = np.pi / 24 if shape == "torus" else 0.0
        rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        vertices = vertices @ rotation.T
    if shape == "torus":
        axis = "z"
    result = simplify(vertices, faces, ratio=ratio, symmetry=axis, attributes={"color": vertices})
    number = "xyz".index(axis)
    one, other = images(result.vertices, number)
    assert np.abs(one - other).max() < 1e-6
    assert open_sides(result.faces) == 0
    assert len(result.faces) <= round(ratio * len(faces))
    assert np.abs(result.attributes["color"] - result.vertices).max() < 0.3  # each side has its own
    assert (result.face_map < len(faces)).all()
    assert (result.vertex_map >= 0).all()


def test_the_other_side_keeps_its_own_values() -> None:
    vertices, faces = ball(3)
    side = (vertices[faces].mean(axis=1)[:, 0] > 0).astype(int)
    uv = vertices[faces][..., 1:] + side[:, None, None]
    result = simplify(vertices, faces, ratio=0.3, symmetry="x", attributes={"side": side, "uv": uv})
    middle = result.vertices[result.faces].mean(axis=1)[:, 0]
    assert np.array_equal(result.attributes["side"], middle > 0)
    offset = result.attributes["uv"] - result.vertices[result.faces][..., 1:]
    assert np.abs(offset - result.attributes["side"][:, None, None]).max() < 0.2


def test_what_is_not_symmetric_is_refused() -> None:
    vertices, faces = ball(2)
    vertices = vertices.copy()
    vertices[0] *= 1.2
    with pytest.raises(MeshError, match="not symmetric over X"):
        simplify(vertices, faces, ratio=0.5, symmetry="x")


def test_nothing_beside_the_plane_is_refused() -> None:
    with pytest.raises(MeshError, match="beside the plane"):
        simplify([[0, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]], ratio=0.5, symmetry="x")
