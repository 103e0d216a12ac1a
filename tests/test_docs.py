# SPDX-License-Identifier: GPL-3.0-or-later
"""What the README shows works, and what the pages link to is there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Give the README's code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, sample_meshes: Path) -> Path:
    """Give a folder with the README's cow in it."""
    pytest.importorskip("bpy")
    from eso_addon.bridge.scene_files import world_triangles
    from eso_addon.files.off import write_off

    write_off(tmp_path / "cow.off", *world_triangles(sample_meshes / "cow.obj"))
    return tmp_path


@pytest.mark.parametrize("code", [code for code in blocks("python") if "bpy" not in code])
def test_python_blocks(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    exec(compile(code, "README.md", "exec"), {})


@pytest.mark.parametrize("code", [code for code in blocks("python") if "bpy" in code])
def test_blender_blocks(code: str, folder: Path) -> None:
    script = f"import bpy, eso_addon\neso_addon.register()\nbpy.ops.mesh.primitive_monkey_add()\n{code}\n"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_console_blocks(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from eso_addon.cli import main

    lines = [line for block in blocks("console") for line in block.splitlines()]
    commands = [shlex.split(line) for line in lines if line.startswith("python -m eso_addon ")]
    assert commands
    monkeypatch.chdir(folder)
    for command in commands:
        assert main(command[3:]) == 0


def test_make_targets_that_pages_name_exist() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    for page in PAGES:
        named = re.findall(r"`make ([a-z]+)`", page.read_text(encoding="utf-8"))
        assert set(named) <= targets, page


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), target
