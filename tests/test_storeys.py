# SPDX-License-Identifier: GPL-3.0-or-later
"""The house rules that a machine can hold: imports point down only, and files and functions keep their form."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "eso_addon"
# What each storey may import of the ones below, and of the outside beyond the standard library.
BELOW = {
    "core": set(),
    "progressive": {"core", "files"},
    "files": set(),
    "bridge": {"core", "progressive", "files"},
    "jobs": {"core"},
    "settings": {"core"},
    "viewer": {"files"},
    "farm": {"core", "files"},
    "operators": {"settings", "jobs", "bridge", "files", "progressive", "viewer", "core"},
    "ui": {"operators", "settings"},
}
BLENDER = {"bmesh", "bpy", "bpy_extras", "io_scene_gltf2", "mathutils", "addon_utils"}
OUTSIDE = {
    "core": {"numpy"},
    "progressive": {"numpy"},
    "files": {"numpy"},
    "bridge": {"numpy", *BLENDER},
    "jobs": {"numpy", *BLENDER},
    "settings": {*BLENDER},
    "viewer": set(),
    "farm": {"numpy", "dask", "distributed", "psutil"},
    "operators": {"numpy", *BLENDER},
    "ui": {"numpy", "gpu", "gpu_extras", "blf", "bl_operators", "bl_ui", *BLENDER},
}
MODULES = sorted(PACKAGE.rglob("*.py"))
OTHERS = ("tests", "benchmarks", "demo", "scripts")
SOURCES = [*MODULES, *(path for folder in OTHERS for path in sorted((ROOT / folder).rglob("*.py")))]


def imports_of(path: Path) -> set[str]:
    """Give the absolute names of all modules that a file imports, also inside functions."""
    package = path.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*above, *([node.module] if node.module else [])])
            names |= {stem} if node.module else {f"{stem}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_down(path: Path) -> None:
    storey = path.relative_to(PACKAGE).parts[0]
    if storey not in BELOW:  # __init__, __main__ and cli stand beside the storeys
        return
    for name in imports_of(path):
        words = name.split(".")
        if words[0] == "eso_addon":
            assert words[1:2] == [storey] or words[1] in BELOW[storey], f"{storey} imports {name}"
        else:
            assert words[0] in OUTSIDE[storey] | set(sys.stdlib_module_names), f"{storey} imports {name}"


def test_every_storey_is_known() -> None:
    folders = {path.parent.name for path in PACKAGE.glob("*/*.py")}
    assert folders <= set(BELOW)


def test_the_root_imports_nothing_at_module_level() -> None:
    body = ast.parse((ROOT / "__init__.py").read_text(encoding="utf-8")).body
    assert not [node for node in body if isinstance(node, (ast.Import, ast.ImportFrom))]


def test_the_package_imports_neither_numpy_nor_blender() -> None:
    code = "import sys, eso_addon; print(*sorted({'numpy', 'bpy'} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.split() == []


def test_the_public_names_are_there_without_blender() -> None:
    code = (
        "import sys; sys.modules['bpy'] = None\n"
        "import eso_addon\n"
        "for name in eso_addon.__all__: getattr(eso_addon, name)\n"
        "assert set(eso_addon.__all__) <= set(dir(eso_addon))\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_an_unknown_name_is_an_attribute_error() -> None:
    import eso_addon

    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = eso_addon.nothing


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_form(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n")
    tree = ast.parse(text)
    if not path.is_relative_to(ROOT / "tests"):
        assert ast.get_docstring(tree), "a file says what it holds"
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and path.is_relative_to(PACKAGE):
            lines = (node.end_lineno or 0) - node.lineno + 1 - docstring_lines(node)
            assert lines <= 60, f"{node.name} has {lines} lines"


def docstring_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Count the lines of a function's docstring."""
    if ast.get_docstring(node) is None:
        return 0
    return (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
