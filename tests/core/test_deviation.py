# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are known from geometry, and the invariants of a measure."""

import json

import numpy as np
import pytest

from eso_addon.core.deviation import measure
from eso_addon.core.mesh import MeshError

Mesh = tuple[np.ndarray, np.ndarray]


def grid(count: int = 8, size: float = 1.0) -> Mesh:
    u, v = np.meshgrid(np.linspace(0, size, count), np.linspace(0, size, count), indexing="ij")
    index = np.arange(count * count).reshape(count, count)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    vertices = np.column_stack([u.ravel(), v.ravel(), np.zeros(count * count)])
    return vertices, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def rough(seed: int) -> Mesh:
    vertices, faces = grid(12)
    vertices[:, 2] = np.random.default_rng(seed).normal(size=len(vertices)) * 0.05
    return vertices, faces


def test_a_mesh_does_not_deviate_from_itself() -> None:
    result = measure(*rough(0), *rough(0), samples=5000)
    assert result.symmetric.maximum < 1e-12
    assert result.symmetric.normal < 1e-5


def test_parallel_planes_are_their_distance_apart() -> None:
    vertices, faces = grid()
    result = measure(vertices, faces, vertices + [0, 0, 0.25], faces, samples=1000)
    for way in (result.forward, result.backward, result.symmetric):
        assert way.maximum == pytest.approx(0.25, rel=1e-12)
        assert way.mean == pytest.approx(0.25, rel=1e-12)
        assert way.rms == pytest.approx(0.25, rel=1e-12)
        assert way.normal == pytest.approx(0, abs=1e-6)
    assert result.diagonal == pytest.approx(np.sqrt(2))


def test_a_lost_part_shows_in_the_forward_maximum_only() -> None:
    vertices, faces = grid()
    both = np.concatenate([vertices, vertices + [0, 0, 3]]), np.concatenate([faces, faces + len(vertices)])
    result = measure(*both, vertices, faces, samples=1000)
    assert result.forward.maximum == pytest.approx(3)
    assert result.forward.mean == pytest.approx(1.5, rel=0.01)
    assert result.backward.maximum < 1e-12
    assert result.symmetric.maximum == result.forward.maximum


def test_normals_are_compared_with_their_sign() -> None:
    vertices, faces = grid()
    assert measure(vertices, faces, vertices, faces[:, ::-1], samples=500).symmetric.normal == pytest.approx(180)
    tilted = vertices @ np.array([[1, 0, 0], [0, np.cos(0.1), np.sin(0.1)], [0, -np.sin(0.1), np.cos(0.1)]])
    assert measure(vertices, faces, tilted, faces, samples=500).symmetric.normal == pytest.approx(np.degrees(0.1))


def test_swapping_the_meshes_swaps_the_directions_up_to_sampling() -> None:
    there, back = measure(*rough(1), *rough(2), samples=20000), measure(*rough(2), *rough(1), samples=20000)
    assert there.forward.mean == pytest.approx(back.backward.mean, rel=0.02)
    assert there.symmetric.mean == pytest.approx(back.symmetric.mean, rel=0.02)


def test_figures_scale_with_the_meshes_and_repeat_bit_for_bit() -> None:
    first = measure(*rough(1), *rough(2), samples=3000)
    assert first == measure(*rough(1), *rough(2), samples=3000)
    assert first != measure(*rough(1), *rough(2), samples=3000, seed=1)
    (v0, f0), (v1, f1) = rough(1), rough(2)
    large = measure(v0 * 1024, f0, v1 * 1024, f1, samples=3000)
    assert large.symmetric.mean == pytest.approx(first.symmetric.mean * 1024, rel=1e-9)
    assert large.symmetric.normal == pytest.approx(first.symmetric.normal, rel=1e-6)


def test_zero_area_faces_and_split_seams_change_nothing() -> None:
    vertices, faces = rough(3)
    soup = vertices[faces].reshape(-1, 3)
    corners = np.arange(len(soup)).reshape(-1, 3)
    dirty = np.concatenate([corners, [[0, 0, 1], [2, 2, 2]]])
    whole, split = measure(*rough(4), vertices, faces, samples=3000), measure(*rough(4), soup, dirty, samples=3000)
    assert split.forward.mean == pytest.approx(whole.forward.mean, rel=1e-12)
    assert split.forward.normal == pytest.approx(whole.forward.normal, rel=1e-9)


def test_the_result_is_plain_numbers() -> None:
    result = measure(*rough(1), *rough(2), samples=100)
    again = json.loads(json.dumps(result.to_dict()))
    assert again["symmetric"]["maximum"] == result.symmetric.maximum
    assert set(again) == {"forward", "backward", "symmetric", "diagonal"}


def broken(kind: str) -> Mesh:
    vertices, faces = grid()
    match kind:
        case "empty":
            return np.zeros((0, 3)), np.zeros((0, 3), dtype=int)
        case "no area":
            return vertices, np.array([[0, 0, 1]])
        case "not finite":
            return np.where(np.arange(len(vertices))[:, None] == 3, np.nan, vertices), faces
        case _:
            return vertices, faces + 1


@pytest.mark.parametrize("kind", ["empty", "no area", "not finite", "out of range"])
def test_what_cannot_be_measured_is_refused_in_one_line(kind: str) -> None:
    for meshes in ((*grid(), *broken(kind)), (*broken(kind), *grid())):
        with pytest.raises(MeshError) as error:
            measure(*meshes)
        assert "\n" not in str(error.value)
    with pytest.raises(MeshError, match="samples"):
        measure(*grid(), *grid(), samples=0)
