# SPDX-License-Identifier: GPL-3.0-or-later
"""What README and docs show works, and what the pages link to is there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
# Blocks of these pages are run; decisions tell what was, and show no code to use.
GUIDES = [page for page in PAGES if page.parent.name != "decisions"]
START = """
import sys
sys.path.insert(0, {root!r})
import bpy, eso_addon
eso_addon.register()
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
"""
# Commands that go on until they are stopped.
ENDLESS = {"serve"}


def blocks(language: str) -> list[tuple[str, str]]:
    """Give the code blocks of one language with the names of their pages."""
    found = []
    for page in GUIDES:
        text = page.read_text(encoding="utf-8")
        codes = re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
        found += [(str(page.relative_to(ROOT)), code) for code in codes]
    return found


def named(cases: list[tuple[str, str]]) -> list[str]:
    return [f"{page}-{number}" for number, (page, _) in enumerate(cases)]


PYTHON = [(page, code) for page, code in blocks("python") if "bpy" not in code]
BLENDER = [(page, code) for page, code in blocks("python") if "bpy" in code]
CONSOLE = [(page, code) for page, code in blocks("console") if "python -m eso_addon" in code]


@pytest.fixture(scope="module")
def cow(tmp_path_factory: pytest.TempPathFactory, sample_meshes: Path) -> Path:
    """Give a folder with the README's cow in it."""
    pytest.importorskip("bpy")
    from eso_addon.bridge.scene_files import world_triangles
    from eso_addon.files.off import write_off

    folder = tmp_path_factory.mktemp("cow")
    write_off(folder / "cow.off", *world_triangles(sample_meshes / "cow.obj"))
    return folder


@pytest.mark.parametrize(("page", "code"), PYTHON, ids=named(PYTHON))
def test_python_blocks(page: str, code: str, cow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(cow)
    exec(compile(code, page, "exec"), {})


@pytest.mark.parametrize(("page", "code"), BLENDER, ids=named(BLENDER))
def test_blender_blocks(page: str, code: str, tmp_path: Path) -> None:
    script = START.format(root=str(ROOT)) + code.replace('"/tmp/', f'"{tmp_path.as_posix()}/')
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, page + done.stdout + done.stderr


@pytest.mark.parametrize(("page", "code"), CONSOLE, ids=named(CONSOLE))
def test_console_blocks(page: str, code: str, cow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from eso_addon.cli import main

    commands = [shlex.split(line, comments=True) for line in code.splitlines()]
    monkeypatch.chdir(cow)
    for command in commands:
        if command[:3] == ["python", "-m", "eso_addon"] and command[3] not in ENDLESS:
            assert main(command[3:]) == 0, page


def test_make_targets_that_pages_name_exist() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    for page in PAGES:
        called = re.findall(r"`make ([a-z]+)`", page.read_text(encoding="utf-8"))
        assert set(called) <= targets, page


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), target
