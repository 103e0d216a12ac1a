# SPDX-License-Identifier: GPL-3.0-or-later
"""A file appears whole or not at all, with its companions, and nothing is left lying about."""

from pathlib import Path

import pytest

from eso_addon.files.atomic import atomic_output


def test_the_target_appears_at_the_end(tmp_path: Path) -> None:
    target = tmp_path / "mesh.obj"
    target.write_text("old")
    with atomic_output(target) as draft:
        draft.write_text("new")
        draft.with_suffix(".mtl").write_text("material")
        assert target.read_text() == "old"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"mesh.obj": "new", "mesh.mtl": "material"}


def test_a_folder_beside_it_takes_new_files_and_keeps_others(tmp_path: Path) -> None:
    (tmp_path / "mesh_textures").mkdir()
    for name in ("mine.png", "shared.png"):
        (tmp_path / "mesh_textures" / name).write_text("old")
    with atomic_output(tmp_path / "mesh.gltf") as draft:
        draft.write_text("new")
        (draft.parent / "mesh_textures/deep").mkdir(parents=True)
        (draft.parent / "empty").mkdir()
        for name in ("shared.png", "deep/one.png"):
            (draft.parent / "mesh_textures" / name).write_text("new")
    found = {path.relative_to(tmp_path).as_posix(): path.read_text() for path in tmp_path.rglob("*") if path.is_file()}
    assert found == {"mesh.gltf": "new", "mesh_textures/mine.png": "old", "mesh_textures/shared.png": "new",
                     "mesh_textures/deep/one.png": "new"}
    assert not (tmp_path / "empty").exists()


def test_a_failure_leaves_everything_as_it_was(tmp_path: Path) -> None:
    target = tmp_path / "mesh.obj"
    target.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic_output(target) as draft:  # noqa: PT012
        draft.write_text("half")
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.obj"]
    assert target.read_text() == "old"


def test_nothing_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="nothing was written"), atomic_output(tmp_path / "mesh.obj"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_bad_targets(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist"), atomic_output(tmp_path / "no" / "mesh.obj"):
        pass
    with pytest.raises(IsADirectoryError, match="is a folder"), atomic_output(tmp_path):
        pass


def test_a_folder_that_takes_no_files_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> str:
        raise PermissionError(13, "Permission denied", "/somewhere/.eso_lod_x")

    monkeypatch.setattr("tempfile.mkdtemp", refuse)
    with pytest.raises(OSError, match=r"cannot write mesh\.obj in .*: Permission denied; give another folder$"), \
            atomic_output(tmp_path / "mesh.obj"):
        pass
