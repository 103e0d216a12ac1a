# SPDX-License-Identifier: GPL-3.0-or-later
"""The job type for Flamenco, compiled with stand-ins for what the Manager offers."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

HARNESS = """
const fs = require("fs"), path = require("path");
const make = (name, type) => ({ name, type, commands: [], needs: [],
  addCommand(command) { this.commands.push(command); }, addDependency(task) { this.needs.push(task.name); } });
const author = { Task: make, Command: (name, parameters) => ({ name, parameters }) };
const [script, settings] = process.argv.slice(1), tasks = [];
const job = { settings: JSON.parse(settings), addTask: (task) => tasks.push(task) };
const run = new Function("author", "path", "job", fs.readFileSync(script, "utf8") +
  "; compileJob(job); return JOB_TYPE;");
const type = run(author, path, job);
console.log(JSON.stringify({ tasks, keys: type.settings.map((setting) => setting.key) }));
"""


def compiled(root: Path, **settings: object) -> dict:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    command = [node, "-e", HARNESS, str(root / "scripts/flamenco/eso_lod.js"), json.dumps(settings)]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def test_a_task_for_each_file(root: Path) -> None:
    found = compiled(root, files="/lib/a.obj; /lib/s/a.ply\n/lib/a.PLY\n", input_dir="/lib/", output_dir="/out",
                     levels="--ratios 0.5,0.1", ending=".glb", profile="unity", chunk_size=1)
    folders, *tasks = found["tasks"]
    assert folders["commands"][0]["parameters"]["args"][-2:] == ["/out", "/out/s"]
    assert [task["needs"] for task in tasks] == [["folders"]] * 3
    words = [task["commands"][0]["parameters"]["args"] for task in tasks]
    assert [word[:5] for word in words] == [
        ["--command", "eso_lod", "lod", "/lib/a.obj", "/out/a.obj.glb"],
        ["--command", "eso_lod", "lod", "/lib/s/a.ply", "/out/s/a.glb"],
        ["--command", "eso_lod", "lod", "/lib/a.PLY", "/out/a.PLY.glb"]]
    assert all(word[5:] == ["--profile", "unity", "--ratios", "0.5,0.1"] for word in words)
    from eso_addon.cli import _parser

    for word in words:  # what it runs is what the command line takes
        assert _parser().parse_args(word[2:]).ratios == [0.5, 0.1]


def test_the_folders_of_tasks_run(root: Path, tmp_path: Path) -> None:
    import sys

    found = compiled(root, files=f"{tmp_path}/x.obj", output_dir=f"{tmp_path}/new/out", levels="--ratios 0.5")
    args = found["tasks"][0]["commands"][0]["parameters"]["args"]
    code = args[args.index("--python-expr") + 1]
    subprocess.run([sys.executable, "-c", code, *args[args.index("--"):]], check=True)
    assert (tmp_path / "new/out").is_dir()


def test_files_in_chunks(root: Path) -> None:
    found = compiled(root, files=";".join(f"/lib/{n}.obj" for n in range(7)), output_dir="/out", levels="--faces 10",
                     chunk_size=3)
    assert [len(task["commands"]) for task in found["tasks"]] == [1, 3, 3, 1]
