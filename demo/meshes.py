# SPDX-License-Identifier: GPL-3.0-or-later
"""The cow, and Blender's own Decimate on it."""

from importlib.util import find_spec
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from eso_addon.bridge.read_mesh import read_mesh

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def sample_mesh(name: str) -> Path:
    """Find a mesh in pymeshlab's wheel, without importing pymeshlab, which does not go well with bpy."""
    spec = find_spec("pymeshlab")
    if spec is None or not spec.submodule_search_locations:
        raise FileNotFoundError("pymeshlab is not installed: its wheel holds the demo's cow; run make demo")
    return Path(spec.submodule_search_locations[0]) / "tests" / "sample_meshes" / name


def decimate(obj: bpy.types.Object, triangles: int) -> Mesh:
    """Simplify an object with the Decimate modifier; the object stays as it is."""
    modifier = obj.modifiers.new("Decimate", "DECIMATE")
    modifier.ratio = triangles / len(obj.data.polygons)
    mesh = read_mesh(obj)
    obj.modifiers.remove(modifier)
    return mesh.vertices, mesh.triangles
