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
