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
for _ in range(2):
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.eso_lod")
    assert not hasattr(bpy.types, "OBJECT_OT_eso_simplify"), "still registered"
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.eso_lod")
    assert hasattr(bpy.types, "OBJECT_OT_eso_simplify"), "not registered again"
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    builder = [sys.executable, str(ROOT / "scripts" / "build_package.py"), str(folder)]
    subprocess.run(builder, check=True, capture_output=True)
    return next(folder.glob("*.zip"))


def test_contents(package: Path) -> None:
    names = {name for name in zipfile.ZipFile(package).namelist() if not name.endswith("/")}
    sources = (path.relative_to(ROOT) for path in (ROOT / "eso_addon").rglob("*") if path.is_file())
    addon = {
        path.as_posix() for path in sources if not any(part[0] == "." or part == "__pycache__" for part in path.parts)
    }
    assert names == {"blender_manifest.toml", "__init__.py", "LICENSE"} | addon


def test_it_is_small(package: Path) -> None:
    assert package.stat().st_size < 2_000_000


def test_what_is_not_the_add_on_is_refused(tmp_path: Path) -> None:
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        from build_package import check
    finally:
        sys.path.pop(0)
    for name in ("tests/test_a.py", "eso_addon/core/.cache/x.db", "data/model.obj", "eso_addon/a.pyc"):
        strange = tmp_path / "strange.zip"
        with zipfile.ZipFile(strange, "w") as archive:
            archive.writestr("blender_manifest.toml", "")
            archive.writestr(name, "")
        with pytest.raises(SystemExit, match="not the add-on's"):
            check(strange)


def test_no_source_edits_the_path_or_imports_itself_by_name() -> None:
    for path in (ROOT / "eso_addon").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"sys\.path(\.\w|\[[^\]]*\]\s*=|\s*\+?=)", text), path
        assert not re.search(r"^\s*(import|from) eso_addon", text, flags=re.MULTILINE), path


ANOTHER_KEY = """
import os, stat, sys, zipfile
import bpy, addon_utils
package, folder = sys.argv[1:]
# The same files as an add-on of another name, in a folder that cannot be written.
place = os.path.join(folder, "addons", "other_name")
zipfile.ZipFile(package).extractall(place)
for path, _, files in os.walk(place, topdown=False):
    for name in files:
        os.chmod(os.path.join(path, name), stat.S_IREAD)
    os.chmod(path, stat.S_IREAD | stat.S_IEXEC)
scripts = bpy.context.preferences.filepaths.script_directories.new()
scripts.name, scripts.directory = "other", folder
sys.path.append(os.path.join(folder, "addons"))
for _ in range(2):
    assert addon_utils.enable("other_name", default_set=True) is not None
    assert bpy.context.preferences.addons["other_name"].preferences.threads == 0
    bpy.ops.wm.read_homefile(use_factory_startup=False, use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.eso_simplify(ratio=0.5)
    assert len(bpy.context.object.data.polygons) < 500
    addon_utils.disable("other_name", default_set=True)
    assert not hasattr(bpy.types, "OBJECT_OT_eso_simplify")
for path, _, _ in os.walk(place):
    os.chmod(path, stat.S_IRWXU)
"""


def test_another_key_and_a_folder_that_cannot_be_written(package: Path, tmp_path: Path) -> None:
    folder = tmp_path / "scripts"
    (folder / "addons").mkdir(parents=True)
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user"), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("PYTHONPATH", None)
    command = [sys.executable, "-c", ANOTHER_KEY, str(package), str(folder)]
    run = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr


def test_it_installs_and_works(package: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    home = tmp_path / "häuschen mit Platz 家"
    home.mkdir()
    environment = {**os.environ, "HOME": str(home), "BLENDER_USER_RESOURCES": str(home / "blender ファイル")}
    environment.pop("PYTHONPATH", None)
    command = [sys.executable, "-c", INSTALL_AND_RUN, str(package), str(report)]
    run = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    figures = json.loads(report.read_text())
    assert figures["faces"] == [[0, 1, 2]]
    assert len(figures["triangles"]) == 1
    assert 480 <= figures["triangles"][0] <= 484
