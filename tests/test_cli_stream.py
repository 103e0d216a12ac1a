# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's words for streams."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from eso_addon.bridge.attributes import read_attribute
from eso_addon.cli import main
from eso_addon.files.off import read_off, write_off
from eso_addon.progressive.scene import load_scene
from tests.bridge.blender_scenes import activate, add_cube, add_sphere, empty_file
from tests.progressive.meshes import grid

__all__ = ["empty_file"]


@pytest.fixture
def torus(tmp_path: Path) -> Path:
    points, faces = grid(14, 14, np.random.default_rng(0), closed=True)
    write_off(tmp_path / "torus.off", points.astype(float), faces)
    return tmp_path / "torus.off"


def test_off_there_and_back(torus: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stream, back = torus.with_suffix(".esopm"), torus.with_stem("back")
    assert main(["stream", str(torus), str(stream), "--keep-order"]) == 0
    assert main(["restore", str(stream), str(back)]) == 0
    before, after = read_off(torus), read_off(back)
    assert np.array_equal(before[0].astype(np.float32), after[0].astype(np.float32))
    assert np.array_equal(before[1], after[1])
    assert main(["info", str(stream)]) == 0
    assert "392 triangles" in capsys.readouterr().out
    assert main(["restore", str(stream), str(back), "--faces", "100"]) == 0
    assert len(read_off(back)[1]) <= 100
    assert main(["restore", str(stream), str(back), "--bytes", str(stream.stat().st_size * 2 // 3)]) == 0
    assert 12 <= len(read_off(back)[1]) < 392


def test_methods_and_bits(torus: Path) -> None:
    stream = torus.with_suffix(".esopm")
    for more in (["--epsilon", "0.5"], ["--method", "eso"], ["--bits", "12"]):
        assert main(["stream", str(torus), str(stream), *more]) == 0
        assert load_scene(stream).face_count == 392


def test_objects_names_and_places_through_blender(tmp_path: Path) -> None:
    ball, box = add_sphere(), add_cube()
    box.location = (4, 0, 0)
    activate(ball, box)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    positions = read_attribute(ball.data, "position")
    stream, back = tmp_path / "two.esopm", tmp_path / "back.blend"
    assert main(["stream", str(tmp_path / "two.blend"), str(stream), "--keep-order"]) == 0
    assert main(["restore", str(stream), str(back)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(back))
    ball, box = bpy.data.objects["Ball"], bpy.data.objects["Box"]
    assert tuple(box.matrix_world.translation) == (4, 0, 0)
    assert np.array_equal(read_attribute(ball.data, "position"), positions)
    assert len(box.data.polygons) == 6
    assert main(["restore", str(stream), str(tmp_path / "back.glb"), "--faces", "200"]) == 0
    assert (tmp_path / "back.glb").stat().st_size > 0


def test_errors_are_one_line(torus: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stream = torus.with_suffix(".esopm")
    assert main(["stream", str(torus), str(stream)]) == 0
    data = stream.read_bytes()
    stream.write_bytes(data[: len(data) // 2])
    capsys.readouterr()
    out = torus.with_stem("out")
    assert main(["restore", str(stream), str(out)]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not out.exists()
    assert main(["restore", str(stream), str(out), "--partial"]) == 0
    assert "cut short" in capsys.readouterr().err
    assert main(["restore", str(torus.with_stem("none").with_suffix(".esopm")), str(out)]) == 1
    for words in (["stream", str(torus), "a.ply"], ["stream", str(torus), "a.esopm", "--bits", "99"],
                  ["restore", str(stream), str(out), "--faces", "0"]):
        assert main(words) == 2
    assert main(["stream", str(torus), str(stream), "--method", "eso", "--epsilon", "0"]) == 1
