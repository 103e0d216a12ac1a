# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's meshes by name: files from a folder or from pymeshlab's wheel, and generated ones."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import partial
from pathlib import Path

from . import shapes
from .readers import Mesh, read_mesh

MODELS = ("bunny.obj", "horse.ply", "hand.obj", "fandisk.obj", "rocker-arm.obj", "turbineblade.ply", "dragon_25k.obj")
GENERATED = {"scan250k": 250_000, "scan1M": 1_000_000, "scan4M": 4_000_000}
SPECIAL = {"grid": shapes.grid, "cylinder": shapes.cylinder, "parts": shapes.parts}
SPECIAL_TRIANGLES = 250_000


def shipped_folder() -> Path | None:
    """Return the folder of sample meshes in pymeshlab's wheel, without importing it (it clashes with bpy)."""
    found = importlib.util.find_spec("pymeshlab")
    if found is None or found.origin is None:
        return None
    folder = Path(found.origin).parent / "tests" / "sample_meshes"
    return folder if folder.is_dir() else None


def catalogue(models: Path | None) -> dict[str, Callable[[], Mesh]]:
    """Return every mesh that can be had here, by name, as a function that makes it.

    Parameters
    ----------
    models : Path or None
        Folder of benchmark models; without it, only the wheel's and the generated meshes.
    """
    found: dict[str, Callable[[], Mesh]] = {}
    shipped = shipped_folder()
    if models is not None:
        found = {Path(name).stem: partial(read_mesh, models / name) for name in MODELS if (models / name).is_file()}
    if shipped is not None:
        found["cow"] = partial(read_mesh, shipped / "cow.obj")
        if "bunny" not in found:
            found["bunny"] = partial(read_mesh, shipped / "bunny.obj")
    for name, triangles in GENERATED.items():
        found[name] = partial(shapes.scan, triangles)
    for name, shape in SPECIAL.items():
        found[name] = partial(shape, SPECIAL_TRIANGLES)
    return found
