# SPDX-License-Identifier: GPL-3.0-or-later
"""Switching the add-on on costs next to nothing: what works with arrays is loaded where it works."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")
ROOT = Path(__file__).parent.parent

# Blender's Python module has imported numpy itself: whoever asks for it again gets an error here.
WITHOUT_NUMPY = """
import sys
import bpy
sys.modules.update({name: None for name in list(sys.modules) if name.split(".")[0] == "numpy"} | {"numpy": None})
import eso_addon
for _ in range(2):
    eso_addon.register()
    assert hasattr(bpy.types, "OBJECT_OT_eso_simplify")
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.view_layer.update()
    assert bpy.ops.object.eso_simplify.poll()
    assert bpy.ops.object.eso_lod_generate.poll()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    eso_addon.unregister()
print(*sorted(name for name in sys.modules if name.startswith("eso_addon.core.")))
"""


def test_enabling_asking_and_disabling_need_no_numpy() -> None:
    run = subprocess.run([sys.executable, "-c", WITHOUT_NUMPY], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "Traceback" not in run.stderr, run.stderr  # of a handler
    assert set(run.stdout.split()[-2:]) == {"eso_addon.core.errors", "eso_addon.core.steps"}, run.stdout
