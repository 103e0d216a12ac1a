# SPDX-License-Identifier: GPL-3.0-or-later
"""Several meshes in one file: each comes back, levels are shared out by error."""

from pathlib import Path

import numpy as np
import pytest

from eso_addon.core.mesh import MeshError
from eso_addon.progressive.errors import StreamError
from eso_addon.progressive.progressive import from_bytes, progressive
from eso_addon.progressive.scene import Scene, load_scene, scene_from_bytes

from .meshes import grid


@pytest.fixture(scope="module")
def scene() -> Scene:
    meshes = []
    for size in (8, 16, 4):
        points, faces = grid(size, size, np.random.default_rng(size), closed=size > 4)
        meshes.append(progressive(points, faces, base_faces=8, meta={"name": str(size)}))
    large = (np.diag([9.0, 9.0, 9.0, 1.0])).ravel().tolist()
    entries = [("A", 0, large), ("B", 1, np.eye(4).ravel().tolist()), ("C", 1, np.eye(4).ravel().tolist())]
    return Scene(meshes, {"objects": [{"name": name, "mesh": mesh, "matrix": m} for name, mesh, m in entries]})


def test_every_mesh_comes_back(scene: Scene, tmp_path: Path) -> None:
    size = scene.save(tmp_path / "a.esopm", keep_order=True)
    assert (tmp_path / "a.esopm").stat().st_size == size
    read = load_scene(tmp_path / "a.esopm")
    assert read.meta == scene.meta
    assert [mesh.meta for mesh in read.meshes] == [{"name": "8"}, {"name": "16"}, {"name": "4"}]
    for mine, other in zip(scene.levels(), read.levels(), strict=True):
        assert mine.vertices.tobytes() == other.vertices.tobytes()
        assert np.array_equal(mine.faces, other.faces)
    assert read.to_bytes() == scene.to_bytes(keep_order=True)


def test_levels_are_shared_out(scene: Scene) -> None:
    read = scene_from_bytes(scene.to_bytes())
    base = sum(mesh.base_faces for mesh in read.meshes)
    for faces in range(base, read.face_count, 53):
        counts = [len(level.faces) for level in read.levels(faces=faces)]
        assert faces - 2 < sum(counts) <= faces or sum(counts) == base
    assert [len(level.faces) for level in read.levels(faces=1)] == [mesh.base_faces for mesh in read.meshes]
    assert sum(len(level.faces) for level in read.levels(faces=10**6)) == read.face_count


def test_errors_are_the_scenes(scene: Scene) -> None:
    assert scene.scales() == [9.0, 1.0, 1.0]
    levels = scene.levels(error=0.5)
    own = [mesh.at(error=0.5 / scale) for mesh, scale in zip(scene.meshes, scene.scales(), strict=True)]
    assert [len(level.faces) for level in levels] == [len(level.faces) for level in own]
    with pytest.raises(MeshError, match="not both"):
        scene.levels(faces=3, error=1.0)


def test_any_prefix_refines_all(scene: Scene) -> None:
    data = scene.to_bytes()
    seen = [0, 0, 0]
    for size in range(len(data) // 3, len(data), len(data) // 9):
        part = scene_from_bytes(data[:size], partial=True)
        counts = [mesh.face_count for mesh in part.meshes]
        assert part.damage
        assert all(now >= before for now, before in zip(counts, seen, strict=True))
        seen = counts
    with pytest.raises(StreamError):
        scene_from_bytes(data[:200], partial=True)


def test_one_mesh_is_asked_of_a_file_of_several(scene: Scene) -> None:
    with pytest.raises(StreamError, match="load_scene"):
        from_bytes(scene.to_bytes())
    with pytest.raises(MeshError, match="no mesh"):
        Scene([]).to_bytes()


def test_a_place_that_is_none_is_refused_before_it_is_written(scene: Scene) -> None:
    lost = Scene(scene.meshes, {"objects": [{"name": "lost", "mesh": 0, "matrix": [float("nan")] * 16}]})
    with pytest.raises(MeshError, match="lost has a transform that is not finite"):
        lost.to_bytes()
