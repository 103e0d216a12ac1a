# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip for Blender: built by Blender's own tool, holds the add-on alone, and works once installed."""

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("bpy")
ROOT = Path(__file__).parent.parent

INSTALL_AND_RUN = """
import json, sys
import bpy
package, report = sys.argv[1:]
bpy.ops.extensions.package_install_files(filepath=package, repo="user_default", enable_on_install=True)
assert "bl_ext.user_default.eso_lod" in bpy.context.preferences.addons, "not enabled"
from bl_ext.user_default.eso_lod import eso_addon
bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
source = bpy.context.object
bpy.ops.object.eso_simplify(ratio=0.5)
results = [o for o in bpy.context.scene.objects if o.type == "MESH" and o != source]
corners, triangles = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
same = eso_addon.simplify(corners, triangles, ratio=1.0)
json.dump({"triangles": [len(o.data.polygons) for o in results], "faces": same.faces.tolist()}, open(report, "w"))
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.eso_lod")
assert not hasattr(bpy.types, "OBJECT_OT_eso_simplify"), "still registered"
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    builder = [sys.executable, str(ROOT / "scripts" / "build_package.py"), str(folder)]
    subprocess.run(builder, check=True, capture_output=True)
    return next(folder.glob("*.zip"))


def test_contents(package: Path) -> None:
    names = {name for name in zipfile.ZipFile(package).namelist() if not name.endswith("/")}
    sources = (path for path in (ROOT / "eso_addon").rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    addon = {path.relative_to(ROOT).as_posix() for path in sources}
    assert names == {"blender_manifest.toml", "__init__.py", "LICENSE"} | addon


def test_no_source_edits_the_path_or_imports_itself_by_name() -> None:
    for path in (ROOT / "eso_addon").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "sys.path" not in text, path
        assert not re.search(r"^\s*(import|from) eso_addon", text, flags=re.MULTILINE), path


def test_it_installs_and_works(package: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    environment.pop("PYTHONPATH", None)
    command = [sys.executable, "-c", INSTALL_AND_RUN, str(package), str(report)]
    run = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    figures = json.loads(report.read_text())
    assert figures["faces"] == [[0, 1, 2]]
    assert len(figures["triangles"]) == 1
    assert 480 <= figures["triangles"][0] <= 484
