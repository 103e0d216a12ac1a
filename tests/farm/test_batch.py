# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches: what is below comes out below, once; what fails is set aside; runs go on; any scheduler gives the same."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from eso_addon.cli import main
from eso_addon.farm.child import work_off
from eso_addon.farm.ledger import NAME, Ledger, Row, sole_run
from eso_addon.farm.library import list_library, sweep
from eso_addon.files.off import read_off, write_off

ROOT = Path(__file__).parent.parent.parent
FORMATS = (".obj", ".off", ".ply", ".gltf", ".glb")


def ball(path: Path, rows: int = 6) -> Path:
    """Write an .off file, which needs no Blender: an octahedron whose faces were cut again and again."""
    vertices = np.concatenate((np.eye(3), -np.eye(3)))
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(rows // 2):
        a, b, c = faces.T
        keys = np.sort(np.stack((faces, np.roll(faces, -1, axis=1)), axis=-1).reshape(-1, 2), axis=1)
        edges, number = np.unique(keys, axis=0, return_inverse=True)
        ab, bc, ca = (number.reshape(-1, 3) + len(vertices)).T
        vertices = np.concatenate((vertices, vertices[edges].mean(axis=1)))
        faces = np.concatenate([np.stack(f, axis=1) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    path.parent.mkdir(parents=True, exist_ok=True)
    write_off(path, vertices / np.linalg.norm(vertices, axis=1, keepdims=True) * (1, 2, 3), faces)
    return path


@pytest.fixture
def library(tmp_path: Path) -> Path:
    for name in ("a.off", "b/c.off", "b/d/e.off"):
        ball(tmp_path / "in" / name)
    return tmp_path / "in"


def rows_of(folder: Path) -> dict[str, Row]:
    ledger = Ledger(folder)
    rows = ledger.rows()
    ledger.close()
    return rows


def batch(*words: object) -> int:
    pytest.importorskip("distributed")
    return main(["batch", *map(str, words)])


def stop_times(folder: Path) -> list[tuple]:
    """Give what the ledger holds; a run that has just begun may not have made its table yet."""
    if not (folder / NAME).exists():
        return []
    with closing(sqlite3.connect(folder / NAME)) as file:
        if not file.execute("SELECT 1 FROM sqlite_master WHERE name = 'files'").fetchone():
            return []
        return file.execute("SELECT path, finished, seconds FROM files ORDER BY path").fetchall()


def test_a_run_a_second_and_a_report(library: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    (library / "b/bad.off").write_text("OFF\n3 1")
    (library / "zero.off").write_text("")
    (library / "x.obj").mkdir()
    assert batch(library, out, "--ratios", "0.5,0.1", "--workers", 1) == 1
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert "3 of 6 files" in told.err
    for name in ("a", "b/c", "b/d/e"):
        fine, coarse = (len(read_off(out / f"{name}_LOD{level}.off")[1]) for level in (0, 1))
        assert fine in (255, 256)
        assert coarse in (50, 51)
    rows = rows_of(out)
    assert {name: row.result for name, row in rows.items()} == {
        "a.off": "done", "b/c.off": "done", "b/d/e.off": "done", "b/bad.off": "set aside", "zero.off": "set aside",
        "x.obj": "set aside"}
    assert "empty" in rows["zero.off"].error
    assert "folder" in rows["x.obj"].error
    assert rows["b/bad.off"].error
    done = rows["b/c.off"]
    assert (done.triangles, done.tries) == (512, 1)
    assert done.triangles_after in (50, 51)
    assert done.deviation > 0 < done.seconds
    before = stop_times(out)
    for bad in ("b/bad.off", "zero.off"):
        (library / bad).unlink()
    (library / "x.obj").rmdir()
    ball(library / "a.off", rows=8)  # a changed file
    ball(library / "new.off")
    assert batch(library, out, "--ratios", "0.5,0.1", "--workers", 1) == 0
    assert len(read_off(out / "a_LOD0.off")[1]) in (1023, 1024)
    assert {"b/c.off", "b/d/e.off"} <= {name for name, *_ in set(before) & set(stop_times(out))}
    assert batch("--report", out) == 0
    for page in ("report.md", "report.html"):
        text = (out / page).read_text(encoding="utf-8")
        assert all(name in text for name in ("a.off", "b/c.off", "new.off", "zero.off", "x.obj is a folder"))
    assert not list(out.rglob(".eso_lod_*"))


def test_a_run_that_is_stopped_goes_on(library: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    for number in range(12):
        ball(library / f"many/{number}.off", rows=10)
    out = tmp_path / "out"
    command = [sys.executable, "-m", "eso_addon", "batch", str(library), str(out), "--ratios", "0.5", "--workers", "1"]
    for how, code in ((signal.SIGINT, 1), (signal.SIGKILL, -9)):
        run = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        known = len(stop_times(out))
        while run.poll() is None and len(stop_times(out)) < known + 2:
            time.sleep(0.05)
        for _ in range(3):  # as people do who press it again
            run.send_signal(how)
            time.sleep(0.3)
        _, told = run.communicate(timeout=60)
        assert run.returncode == code
        assert "Traceback" not in told
        assert "KeyboardInterrupt" not in told
    before = stop_times(out)
    assert 4 <= len(before) < 15
    assert subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0
    assert set(before) <= set(stop_times(out))
    assert len(stop_times(out)) == 15
    assert not list(out.rglob(".eso_lod_*"))


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    pytest.importorskip("distributed")
    place, quiet = tmp_path / "scheduler.json", {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    made = [subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port",
                              "0", "--dashboard-address", "127.0.0.1:0", "--scheduler-file", str(place)],
                             env=environment, **quiet)]
    made += [subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(place),
                               "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)],
                              env=environment, **quiet) for _ in range(2)]
    try:
        ends = time.monotonic() + 60
        while not place.exists() and time.monotonic() < ends:
            time.sleep(0.1)
        yield json.loads(place.read_text())["address"]
    finally:
        for process in reversed(made):
            process.terminate()
        for process in made:
            process.wait(30)


def test_a_remote_scheduler_gives_the_same(library: Path, tmp_path: Path, scheduler: str) -> None:
    assert batch(library, tmp_path / "here", "--ratios", "0.5,0.1", "--workers", 1) == 0
    assert batch(library, tmp_path / "there", "--ratios", "0.5,0.1", "--scheduler", scheduler) == 0
    here = {path.relative_to(tmp_path / "here"): path.read_bytes() for path in (tmp_path / "here").rglob("*.off")}
    there = {path.relative_to(tmp_path / "there"): path.read_bytes() for path in (tmp_path / "there").rglob("*.off")}
    assert here == there
    assert len(here) == 6


CHILD = """
import os, signal, time
from eso_addon.farm.serving import serve

def answer(request):
    if request.get("marks"):
        with open(request["marks"], "a") as file:
            file.write("x")
    if request["do"] == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if request["do"] == "killed" and os.path.getsize(request["marks"]) < 4:
        os.kill(os.getpid(), signal.SIGKILL)
    if request["do"] == "hang":
        time.sleep(60)
    if request["do"] == "eat":
        kept = []
        for _ in range(600):
            kept.append(bytearray(os.urandom(1) * 2**22))
            time.sleep(0.002)
    print("chatter")
    return {"did": request["do"], "pid": os.getpid()}

serve(answer)
"""


@pytest.fixture
def child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "child_of_a_test.py").write_text(CHILD)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return "child_of_a_test"


@pytest.mark.parametrize(("do", "told", "tries"), [
    ("crash", "SIGSEGV", 2), ("hang", "longer than 2", 2), ("eat", "GiB", 2), ("killed", "", 4), ("well", "", 1)])
def test_what_becomes_of_a_child(child: str, tmp_path: Path, do: str, told: str, tries: int) -> None:
    marks = tmp_path / "marks"
    marks.touch()
    answer = work_off(child, {"do": do, "marks": str(marks)}, 2 if do == "hang" else 60, 2**28)
    assert told in answer.get("error", "")
    assert bool(answer.get("error")) == bool(told)
    assert answer["tries"] == tries == len(marks.read_text())
    good = [work_off(child, {"do": "well"}, 60, 2**28)["pid"] for _ in range(2)]
    assert good[0] == good[1]  # it is kept
    work_off(child, {"do": "well"}, 60, 2**28, keep=False)


def test_textures_of_two_models_in_a_folder(tmp_path: Path) -> None:
    bpy = pytest.importorskip("bpy")
    from eso_addon.bridge.nodes import use_nodes
    from eso_addon.bridge.scene_files import start_empty

    (tmp_path / "in").mkdir()
    for name, colour in (("red", (1, 0, 0, 1)), ("blue", (0, 0, 1, 1))):
        start_empty()
        bpy.ops.mesh.primitive_monkey_add()
        image = bpy.data.images.new("paint", 4, 4)
        image.pixels = colour * 16
        image.pack()
        material = bpy.data.materials.new("skin")
        tree = use_nodes(material)
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        shader = tree.nodes["Principled BSDF"]
        tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        bpy.context.object.data.materials.append(material)
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / f"in/{name}.glb"))
    assert batch(tmp_path / "in", tmp_path / "out", "--ratios", "0.5", "--format", ".gltf", "--workers", 1) == 0
    for name, colour in (("red", (1, 0, 0, 1)), ("blue", (0, 0, 1, 1))):
        start_empty()
        bpy.ops.import_scene.gltf(filepath=str(tmp_path / f"out/{name}.gltf"))
        assert [tuple(image.pixels)[:4] for image in bpy.data.images if image.size[0]] == [colour]


def test_names_that_meet_are_told_apart(tmp_path: Path) -> None:
    for name in ("in/a.obj", "in/a.ply", "in/A.off", "in/b.obj", "in/sub/a.obj", "in/a.obj.glb"):
        ball(tmp_path / name)
    for ending in (None, ".glb"):
        found = list_library(tmp_path / "in", tmp_path / "out", FORMATS, ending)
        targets = [str(entry.target).casefold() for entry in found]
        assert len(set(targets)) == len(targets) == 6
        assert all(entry.target.parent.relative_to(tmp_path / "out") == Path(entry.name).parent for entry in found)
    assert {entry.target.name for entry in found if entry.name == "b.obj"} == {"b.glb"}


def test_what_a_file_names_is_a_part_of_it(tmp_path: Path) -> None:
    def digests() -> list[str]:
        return [entry.digest for entry in list_library(tmp_path / "in", tmp_path / "out", FORMATS)]

    (tmp_path / "in").mkdir()
    (tmp_path / "in/a.obj").write_text("mtllib a.mtl\nv 0 0 0\n")
    (tmp_path / "in/b.gltf").write_text(json.dumps({"buffers": [{"uri": "b%20c.bin"}]}))
    (tmp_path / "in/c.gltf").write_text("no json")
    before = digests()
    (tmp_path / "in/a.mtl").write_text("newmtl a")
    (tmp_path / "in/b c.bin").write_bytes(b"1")
    after = digests()
    assert [one == other for one, other in zip(before, after, strict=True)] == [False, False, True]


def test_odd_places(tmp_path: Path) -> None:
    (tmp_path / "in/x.obj").mkdir(parents=True)
    ball(tmp_path / "in/x.obj/y.off")
    (tmp_path / "in/gone.off").symlink_to("nowhere")
    os.mkfifo(tmp_path / "in/pipe.ply")
    ball(tmp_path / "in/out/z.off")
    found = {entry.name: entry.trouble for entry in list_library(tmp_path / "in", tmp_path / "in/out", FORMATS)}
    assert set(found) == {"x.obj", "x.obj/y.off", "gone.off", "pipe.ply"}
    assert not found.pop("x.obj/y.off")
    assert all(found.values())
    with pytest.raises(ValueError, match="holds the files"):
        list_library(tmp_path / "in", tmp_path, FORMATS)
    (tmp_path / "in/.eso_lod_left").mkdir()
    sweep(tmp_path / "in")
    assert not (tmp_path / "in/.eso_lod_left").exists()


@pytest.mark.parametrize(("words", "code", "told"), [
    (["in", "out"], 1, "--ratios"), (["in"], 1, "two folders"), (["no", "out", "--ratios", "0.5"], 1, "no folder"),
    (["in", "in", "--ratios", "0.5"], 1, "another folder"), (["in", "out", "--ratios", "2"], 2, "ratio"),
    (["in", "out", "--ratios", "0.5", "--workers", "0"], 2, "workers"),
    (["in", "out", "--ratios", "0.5", "--memory-limit", "x"], 2, "memory"),
    (["in", "out", "--ratios", "0.5", "--timeout", "0"], 2, "time"),
    (["no", "--report"], 1, "no folder"), (["in", "--report"], 1, "no ledger.sqlite"),
    (["in", "in/a.off", "--ratios", "0.5"], 1, "is a file"),
    (["in", "out", "--ratios", "0.5", "--scheduler", "tcp://127.0.0.1:1"], 1, "scheduler"),
])
def test_wrong_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
                     words: list[str], code: int, told: str) -> None:
    pytest.importorskip("distributed")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("eso_addon.farm.batch.PATIENCE", 1)
    ball(tmp_path / "in/a.off")
    assert main(["batch", *words]) == code
    assert told in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "in").iterdir()] == ["a.off"]


def test_without_dask_a_line_says_what_to_install(library: Path, tmp_path: Path) -> None:
    code = ("import sys; sys.modules['dask'] = sys.modules['distributed'] = None\n"
            "from eso_addon.cli import main\nsys.exit(main(sys.argv[1:]))")
    done = subprocess.run([sys.executable, "-c", code, "batch", str(library), str(tmp_path / "out"), "--ratios", "0.5"],
                          cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "pip install" in done.stderr
    assert done.stderr.count("\n") == 1


def test_one_run_at_a_time(tmp_path: Path) -> None:
    with sole_run(tmp_path), pytest.raises(ValueError, match="another batch"), sole_run(tmp_path):
        pass
    with sole_run(tmp_path):
        pass


def test_a_file_that_is_no_ledger(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text("not a database, but long enough to be taken for one" * 50)
    with pytest.raises(ValueError, match="no ledger"):
        Ledger(tmp_path)
