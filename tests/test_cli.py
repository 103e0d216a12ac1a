# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: words, exit codes, formats, and one line for every kind of bad input."""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from eso_addon.cli import carry_out, main
from eso_addon.files.off import read_off, write_off
from eso_addon.settings.profiles import PROFILES

ROOT = Path(__file__).parent.parent
NAMED_FORMATS = (".blend", ".fbx", ".glb", ".gltf", ".obj")
NAMELESS_FORMATS = (".off", ".ply", ".stl")


def sphere(rows: int = 16, columns: int = 32) -> tuple[np.ndarray, np.ndarray]:
    """Make a closed sphere of 2 (rows - 1) columns triangles, its poles on the z axis."""
    polar = np.repeat(np.linspace(0, np.pi, rows + 1)[1:-1], columns)
    around = np.tile(np.linspace(0, 2 * np.pi, columns, endpoint=False), rows - 1)
    ring_points = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=1)
    vertices = np.concatenate(([[0, 0, 1]], ring_points, [[0, 0, -1]]))
    here = 1 + np.arange((rows - 2) * columns)
    right = here + np.where((here % columns) == 0, 1 - columns, 1)
    bands = np.concatenate(
        (np.stack((here, here + columns, right), 1), np.stack((right, here + columns, right + columns), 1))
    )
    first, last = 1 + np.arange(columns), 1 + (rows - 2) * columns + np.arange(columns)
    north = np.stack((np.zeros_like(first), first, np.roll(first, -1)), 1)
    south = np.stack((np.full_like(last, len(vertices) - 1), np.roll(last, -1), last), 1)
    return vertices, np.concatenate((bands, north, south))


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    path = tmp_path / "ball.off"
    vertices, faces = sphere()
    write_off(path, vertices * (1, 2, 3), faces)
    return path


def run(*words: object) -> int:
    return main([str(word) for word in words])


def world(path: Path) -> tuple[np.ndarray, np.ndarray]:
    from eso_addon.bridge.scene_files import world_triangles

    return world_triangles(path)


def test_off_to_off_needs_no_blender(ball: Path, tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['bpy'] = None\n"
        "from eso_addon.cli import main\n"
        "sys.exit(main(sys.argv[1:]))"
    )
    words = ["simplify", ball, tmp_path / "small.off", "--faces", "200"]
    command = [sys.executable, "-c", code, *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(read_off(tmp_path / "small.off")[1]) == 200
    assert main(["stream", str(ball), str(tmp_path / "ball.esopm")]) == 0
    for refused in (["simplify", ball, tmp_path / "small.obj", "--faces", "200"],
                    ["restore", tmp_path / "ball.esopm", tmp_path / "back.ply"],
                    ["stream", tmp_path / "ball.ply", tmp_path / "other.esopm"]):
        done = subprocess.run([*command[:3], *map(str, refused)], cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert "pip install bpy" in done.stderr
        assert done.stderr.count("\n") == 1


def test_the_module_keeps_its_output_clean(ball: Path, tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    words = ["simplify", ball, tmp_path / "small.glb", "--ratio", "0.5"]
    command = [sys.executable, "-m", "eso_addon", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("\n") == 2, done.stdout
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["ball:", str(tmp_path / "small.glb")]


@pytest.mark.parametrize("ending", [*NAMED_FORMATS, *NAMELESS_FORMATS])
def test_every_format_out_and_in(ball: Path, tmp_path: Path, ending: str) -> None:
    pytest.importorskip("bpy")
    small, smaller = tmp_path / f"small{ending}", tmp_path / "smaller.off"
    assert run("simplify", ball, small, "--faces", 400) == 0
    vertices, faces = world(small)
    assert len(faces) == 400
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert np.allclose(high, (1, 2, 3), atol=0.15)  # Y forward, Z up: the axes stay where they were
    assert np.allclose(low, (-1, -2, -3), atol=0.15)
    assert run("simplify", small, smaller, "--faces", 100) == 0
    assert len(read_off(smaller)[1]) == 100
    assert not list(tmp_path.glob(".eso_lod*"))


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("ending", NAMED_FORMATS)
def test_levels_are_named_objects(ball: Path, tmp_path: Path, ending: str, profile: str) -> None:
    pytest.importorskip("bpy")
    from eso_addon.bridge.scene_files import SceneFile

    chain = tmp_path / f"chain{ending}"
    assert run("lod", ball, chain, "--faces", "100,400,200", "--profile", profile, "--json", tmp_path / "j.json") == 0
    levels = {name: len(faces) for name, _, faces in SceneFile(chain).parts}
    seen = (400,) if profile == "gltf" and ending in (".glb", ".gltf") else (400, 200, 100)  # MSFT_lod: the finest
    assert levels == {PROFILES[profile].name("ball", level): count for level, count in enumerate(seen)}
    assert [mesh["level"] for mesh in json.loads((tmp_path / "j.json").read_text())["meshes"]] == [0, 1, 2]


@pytest.mark.parametrize("ending", NAMELESS_FORMATS)
def test_levels_are_files_where_objects_have_no_names(ball: Path, tmp_path: Path, ending: str) -> None:
    pytest.importorskip("bpy")
    assert run("lod", ball, tmp_path / f"chain{ending}", "--ratios", "0.5,0.25") == 0
    counts = [len(world(tmp_path / f"chain_LOD{level}{ending}")[1]) for level in range(2)]
    assert counts == [480, 240]
    assert not (tmp_path / f"chain{ending}").exists()


@pytest.fixture
def group(tmp_path: Path) -> Path:
    """Make a file of three meshes that stand apart, one of them hidden, one a child of another, scaled and moved."""
    bpy = pytest.importorskip("bpy")
    from eso_addon.bridge.scene_files import READERS

    vertices, faces = sphere()
    write_off(tmp_path / "one.off", vertices, faces)
    READERS[".off"](tmp_path / "one.off")
    big = bpy.context.scene.objects["one"]
    big.name = "big"
    vertices, faces = sphere(8, 12)
    for name in ("small", "hidden"):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices, (), faces.tolist())
        obj = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(obj)
    bpy.data.objects["small"].parent = big
    bpy.data.objects["small"].location = (5, 0, 0)
    bpy.data.objects["hidden"].hide_set(True)
    big.scale, big.location = (2, 2, 2), (0, 0, 7)
    path = tmp_path / "group.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def test_a_ratio_applies_to_each_mesh_and_a_count_to_all(group: Path, tmp_path: Path) -> None:
    figures = tmp_path / "figures.json"
    before = {"big": 960, "small": 168}
    assert run("simplify", group, tmp_path / "half.glb", "--ratio", "0.5", "--json", figures) == 0
    meshes = {mesh["name"]: mesh for mesh in json.loads(figures.read_text())["meshes"]}
    assert {name: mesh["triangles_before"] for name, mesh in meshes.items()} == before
    assert {name: mesh["triangles_after"] for name, mesh in meshes.items()} == {"big": 480, "small": 84}
    assert run("simplify", group, tmp_path / "count.glb", "--faces", "401", "--json", figures) == 0
    counts = {mesh["name"]: mesh["triangles_after"] for mesh in json.loads(figures.read_text())["meshes"]}
    assert sum(counts.values()) in (400, 401)
    assert counts["small"] / 168 > counts["big"] / 960  # as large a sphere of fewer triangles: each matters more


@pytest.mark.parametrize("ending", [".blend", ".fbx", ".glb", ".obj"])
def test_meshes_stay_where_they_stood(group: Path, tmp_path: Path, ending: str) -> None:
    before, _ = world(group)
    for word, option in (("simplify", "--ratio"), ("lod", "--ratios")):
        target = tmp_path / f"{word}{ending}"
        assert run(word, group, target, option, 1) == 0
        after, faces = world(target)
        assert len(faces) == 1128
        assert np.allclose((after.min(axis=0), after.max(axis=0)), (before.min(axis=0), before.max(axis=0)), atol=1e-4)


def test_measure(ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    vertices, faces = read_off(ball)
    write_off(tmp_path / "moved.off", vertices + (0.25, 0, 0), faces)
    assert run("measure", ball, tmp_path / "moved.off", "--json", tmp_path / "figures.json") == 0
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert set(figures) == {"forward", "backward", "symmetric", "diagonal"}
    assert 0.2 < figures["symmetric"]["maximum"] <= 0.25
    assert "symmetric" in capsys.readouterr().out
    assert run("measure", ball, ball, "--json", tmp_path / "figures.json") == 0
    assert json.loads((tmp_path / "figures.json").read_text())["symmetric"]["maximum"] < 1e-9


def test_engine_words_reach_the_engine(ball: Path, tmp_path: Path) -> None:
    small = tmp_path / "small.off"
    words = ("--method", "qem", "--rings", 2, "--placement", "endpoint", "--no-weld", "--prune", 0)
    assert run("simplify", ball, small, "--faces", 100, *words) == 0
    vertices, _ = read_off(ball)
    kept, _ = read_off(small)
    assert {tuple(point) for point in kept} <= {tuple(point) for point in vertices}  # endpoints are the input's
    assert run("simplify", ball, small, "--faces", 100, "--preset", "paper") == 0
    assert run("simplify", ball, small, "--max-error", 0.1) == 0


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["simplify"],
        ["simplify", "IN", "OUT"],
        ["simplify", "IN", "OUT", "--ratio", "0"],
        ["simplify", "IN", "OUT", "--ratio", "1.5"],
        ["simplify", "IN", "OUT", "--ratio", "nan"],
        ["simplify", "IN", "OUT", "--faces", "0"],
        ["simplify", "IN", "OUT", "--faces", "2.5"],
        ["simplify", "IN", "OUT", "--faces", "inf"],
        ["simplify", "IN", "OUT", "--max-error", "-1"],
        ["simplify", "IN", "OUT", "--ratio", "0.5", "--faces", "3"],
        ["simplify", "IN", "OUT", "--ratio", "0.5", "--method", "magic"],
        ["simplify", "IN", "out.xyz", "--ratio", "0.5"],
        ["lod", "IN", "OUT", "--ratios", "0.5,x"],
        ["lod", "IN", "OUT", "--ratios", "0.5", "--profile", "quake"],
    ],
)
def test_wrong_usage(words: list[str], ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = {"IN": ball, "OUT": tmp_path / "out.off"}
    assert run(*(paths.get(word, word) for word in words)) == 2
    assert "usage:" in capsys.readouterr().err
    assert not (tmp_path / "out.off").exists()


@pytest.mark.parametrize("ending", [*NAMED_FORMATS, *NAMELESS_FORMATS])
@pytest.mark.parametrize("content", [b"", b"nonsense\n", b"\x00\xff\x13glTF" * 9, None])
def test_bad_files_are_one_line(
    ending: str, content: bytes | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("bpy")
    source = tmp_path / f"bad{ending}"
    if content is not None:
        source.write_bytes(content)
    assert run("simplify", source, tmp_path / "out.ply", "--ratio", "0.5") == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("eso_lod: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ([source.name] if content is not None else [])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("OFF\n0 0 0\n", "no mesh with faces"),
        ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no mesh with faces"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n", "not finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n", "not finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "names a vertex"),
    ],
)
def test_bad_meshes_are_one_line(text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.off").write_text(text)
    assert run("simplify", tmp_path / "bad.off", tmp_path / "out.off", "--ratio", "0.5") == 1
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out.off").exists()


@pytest.mark.parametrize("words", [
    ["simplify", "ball.off", "no/out.off", "--ratio", "0.5"], ["lod", "ball.off", "no/out.off", "--ratios", "0.5"],
    ["simplify", "ball.off", "out.off", "--ratio", "0.5", "--json", "no/figures.json"],
    ["lod", "ball.off", "out.off", "--ratios", "0.5", "--json", "no/figures.json"],
    ["measure", "ball.off", "ball.off", "--json", "no/figures.json"],
    ["stream", "ball.off", "no/out.esopm"], ["restore", "ball.esopm", "no/out.off"],
])
def test_places_are_looked_at_before_the_work(words: list[str], ball: Path, monkeypatch: pytest.MonkeyPatch,
                                              capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ball.parent)
    assert run(*words) == 1
    out, err = capsys.readouterr()
    assert "no does not exist" in err
    assert out == ""
    assert [path.name for path in ball.parent.iterdir()] == ["ball.off"]


@pytest.mark.parametrize("words", [
    ["simplify", "ball.off", "out.off", "--ratio", "0.5", "--json", "out.off"],
    ["simplify", "ball.off", "out.off", "--ratio", "0.5", "--json", "ball.off"],
    ["simplify", "ball.off", "out.off", "--ratio", "0.5", "--json", "../FOLDER/here/../ball.off"],
    ["lod", "ball.off", "out.off", "--ratios", "0.5", "--json", "out.off"],
    ["lod", "ball.off", "out.off", "--ratios", "0.5,0.2", "--json", "out_LOD1.off"],
    ["lod", "ball.off", "out.off", "--ratios", "0.5", "--json", "ball.off"],
    ["measure", "ball.off", "ball.off", "--json", "ball.off"],
])
def test_figures_are_written_over_no_mesh(words: list[str], ball: Path, monkeypatch: pytest.MonkeyPatch,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ball.parent)
    (ball.parent / "here").mkdir()
    before = ball.read_bytes()
    assert run(*(word.replace("FOLDER", ball.parent.name) for word in words)) == 1
    out, err = capsys.readouterr()
    assert "give another" in err
    assert err.count("\n") == 1
    assert out == ""
    assert ball.read_bytes() == before
    assert sorted(path.name for path in ball.parent.iterdir()) == ["ball.off", "here"]


@pytest.mark.parametrize("words", [["--workers", "2"], ["--scheduler", "tcp://nobody:1"]])
def test_workers_without_pieces_are_told(words: list[str], ball: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simplify", ball, ball.with_stem("out"), "--ratio", "0.5", *words) == 0
    err = capsys.readouterr().err
    assert "--memory-limit" in err
    assert err.count("\n") == 1


def test_a_count_that_is_out_of_reach_is_told(ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["simplify", ball, tmp_path / "out.off", "--json", tmp_path / "out.json"]
    assert run(*words, "--faces", 1) == 0
    assert "of 1 triangles in all" in capsys.readouterr().out
    told = json.loads((tmp_path / "out.json").read_text())["meshes"][0]
    assert not told["reached"]
    assert told["messages"]
    assert run(*words, "--faces", 100) == 0
    assert json.loads((tmp_path / "out.json").read_text())["meshes"][0]["reached"]


def test_any_error_is_enough(ball: Path, tmp_path: Path) -> None:
    assert run("simplify", ball, tmp_path / "out.off", "--max-error", "1e300") == 0
    assert len(read_off(tmp_path / "out.off")[1]) < 100


def test_ctrl_c_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(_: argparse.Namespace) -> None:
        raise KeyboardInterrupt

    assert carry_out(argparse.Namespace(run=interrupted)) == 1
    assert capsys.readouterr().err == "eso_lod: stopped\n"


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--version") == 0
    assert capsys.readouterr().out.startswith("eso_lod 0.")


def test_the_target_cannot_be_written(ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simplify", ball, tmp_path / "nowhere" / "out.off", "--ratio", "0.5") == 1
    assert "does not exist" in capsys.readouterr().err
    assert run("lod", ball, tmp_path / "out.off", "--ratios", "0.9,0.8,0.7,0.6,0.5", "--profile", "secondlife") == 1
    assert "at most 4 levels" in capsys.readouterr().err


def test_the_output_may_be_the_input(ball: Path) -> None:
    assert run("simplify", ball, ball, "--faces", 100) == 0
    assert len(read_off(ball)[1]) == 100
