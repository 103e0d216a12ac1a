# SPDX-License-Identifier: GPL-3.0-or-later
"""Stream, then restore: the identity, on random meshes of every kind; and every level in between is a mesh."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from eso_addon.core.mesh import MeshError
from eso_addon.progressive.errors import StreamError
from eso_addon.progressive.progressive import from_bytes, load_progressive, progressive

from .meshes import Arrays, fingerprint, grid, meshes, same

QUICK = settings(max_examples=10, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@QUICK
@given(mesh=meshes())
def test_restored_is_the_original_in_its_order(mesh: Arrays) -> None:
    whole = progressive(**mesh, base_faces=4)
    assert same(mesh, from_bytes(whole.to_bytes(keep_order=True)).restore())


@QUICK
@given(mesh=meshes())
def test_restored_without_order_has_the_same_faces(mesh: Arrays) -> None:
    whole = progressive(**mesh, base_faces=4)
    level = from_bytes(whole.to_bytes()).restore()
    attributes = mesh.get("attributes", {})
    assert len(level.vertices) == len(mesh["vertices"])
    assert fingerprint(level.vertices, level.faces, level.attributes) == fingerprint(
        mesh["vertices"], mesh["faces"], attributes
    )


def area_vectors(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[faces[:, row]].astype(np.float64) for row in range(3))
    return np.cross(b - a, c - a)


@QUICK
@given(mesh=meshes())
def test_every_prefix_is_a_mesh(mesh: Arrays) -> None:
    made = progressive(**mesh, base_faces=4)
    read = from_bytes(made.to_bytes())
    finite = np.isfinite(mesh["vertices"]).all()
    with np.errstate(invalid="ignore"):
        flat_before = (area_vectors(mesh["vertices"], mesh["faces"]) == 0).all(axis=1).sum()
        for faces in made.batch_faces:
            level = read.at(faces=int(faces))
            assert len(level.faces) == faces
            assert level.faces.size == 0 or 0 <= level.faces.min() <= level.faces.max() < len(level.vertices)
            own = made.at(faces=int(faces))
            assert np.array_equal(own.faces, level.faces)
            assert own.vertices.tobytes() == level.vertices.tobytes()
            if finite:
                assert (area_vectors(level.vertices, level.faces) == 0).all(axis=1).sum() <= flat_before


@pytest.mark.parametrize("sheets", [2, 3])
def test_closed_fans_of_two_faces_meet_at_a_vertex(sheets: int) -> None:
    rng = np.random.default_rng(sheets)
    corners = 1 + 2 * np.arange(sheets)[:, None]
    front = np.concatenate((np.zeros_like(corners), corners, corners + 1), axis=1)
    faces = np.concatenate((front, front[:, ::-1]))
    mesh = {"vertices": rng.random((1 + 2 * sheets, 3)).astype(np.float32), "faces": faces}
    assert same(mesh, from_bytes(progressive(**mesh, base_faces=1).to_bytes(keep_order=True)).restore())


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_quantised_within_half_a_step(bits: int) -> None:
    points, faces = grid(20, 20, np.random.default_rng(0), closed=True)
    whole = progressive(points, faces)
    kept = from_bytes(whole.to_bytes(bits=bits, keep_order=True)).restore()
    step = float((points.max(axis=0) - points.min(axis=0)).max()) / (2**bits - 1)
    assert np.array_equal(kept.faces, faces)
    assert np.abs(kept.vertices.astype(float) - points).max() <= 0.5 * step + 1e-6


def test_levels_between_batches_keep_to_the_count() -> None:
    points, faces = grid(30, 30, np.random.default_rng(1), closed=True)
    whole = progressive(points, faces)
    for target in range(whole.base_faces, len(faces), 37):
        level = whole.at(faces=target)
        assert target - 2 < len(level.faces) <= target
        assert len(np.unique(level.faces)) == len(level.vertices)
    assert len(whole.at(vertices=100).vertices) == 100


def test_saved_and_loaded_in_part(tmp_path: Path) -> None:
    points, faces = grid(30, 30, np.random.default_rng(2), closed=True)
    whole = progressive(points, faces, meta={"name": "torus"})
    size = whole.save(tmp_path / "a.esopm")
    assert load_progressive(tmp_path / "a.esopm").meta == {"name": "torus"}
    half = load_progressive(tmp_path / "a.esopm", max_bytes=size // 2)
    assert half.damage
    assert whole.base_faces < half.face_count < len(faces)
    assert np.array_equal(half.restore().faces, whole.at(faces=half.face_count).faces)
    with pytest.raises(StreamError, match="100 bytes do not hold"):
        load_progressive(tmp_path / "a.esopm", max_bytes=100)


def test_bad_input_is_told() -> None:
    with pytest.raises(MeshError, match="not there"):
        progressive(np.zeros((3, 3)), [[0, 1, 5]])
    with pytest.raises(MeshError, match="unknown option"):
        progressive(np.zeros((3, 3)), [[0, 1, 2]], speed=3)
    with pytest.raises(MeshError, match="shape"):
        progressive(np.zeros((3, 3)), [[0, 1, 2]], attributes={"face": {"material": [1, 2]}})


def test_bytes_in_either_order_are_the_same_numbers() -> None:
    points, faces = grid(4, 4, np.random.default_rng(0))
    values = np.arange(len(points))
    streams = [progressive(points.astype(f"{order}f4"), faces.astype(f"{order}i8"),
                           attributes={"vertex": {"v": values.astype(f"{order}i4")}}).to_bytes(keep_order=True)
               for order in "<>"]
    assert streams[0] == streams[1]
    assert np.array_equal(from_bytes(streams[1]).restore().attributes["vertex"]["v"], values)
