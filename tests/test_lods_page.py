# SPDX-License-Identifier: GPL-3.0-or-later
"""What docs/lods.md shows works."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from eso_addon.cli import main
from eso_addon.files.off import write_off
from eso_addon.settings.profiles import PROFILES
from tests.core.shapes import ball, noisy

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "lods.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (found,) = re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    return found


def test_the_python_block(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    script = f"import bpy, eso_addon\neso_addon.register()\nbpy.ops.mesh.primitive_monkey_add()\n{block('python')}\n"
    command = [sys.executable, "-c", script]
    found_here = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=found_here, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "levels.fbx").exists()


def test_the_console_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("bpy")
    write_off(tmp_path / "cow.off", *noisy(ball(4), np.random.default_rng(0), 0.01))
    monkeypatch.chdir(tmp_path)
    for line in block("console").splitlines():
        assert main(shlex.split(line)[3:]) == 0


def test_every_profile_is_on_the_page() -> None:
    for profile in PROFILES.values():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{profile.key}` |"))
        assert profile.ending in row
