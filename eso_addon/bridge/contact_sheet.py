# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of many mesh files side by side, each with its label; Cycles needs no screen."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, radians, sqrt
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler

from ..files.atomic import atomic_output
from .nodes import use_nodes
from .quiet import quiet
from .scene_files import world_triangles

_CELL = 170  # pixels of a mesh's side
_TURN = Euler((radians(70), 0, radians(-35)))
_MOST = 400_000  # triangles of all meshes that a picture of this size can show


def contact_sheet(path: Path, files: Sequence[Path], labels: Sequence[str]) -> None:
    """Render the meshes of files in a grid, each in a size of its own.

    Parameters
    ----------
    path
        The PNG to write.
    files
        Files that `scene_files` reads; one that cannot be read leaves its place empty.
    labels
        What stands below each.

    Raises
    ------
    FileFormatError
        Blender cannot render.
    OSError
        The picture cannot be written.
    """
    meshes = [_triangles(file) for file in files]
    with quiet(f"cannot draw {path.name}"):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        columns = ceil(sqrt(len(files) * 1.4))
        rows = ceil(len(files) / columns)
        clay, ink = _material("Clay", (0.62, 0.46, 0.36), 0.0), _material("Ink", (0.06, 0.06, 0.07), 1.0)
        for place, (mesh, label) in enumerate(zip(meshes, labels, strict=True)):
            row, column = divmod(place, columns)
            _add(scene, mesh, label, (column + 0.5, -(row * 1.15 + 0.5)), clay, ink)
        _set_up(scene, columns, rows * 1.15)
        with atomic_output(path) as draft:
            scene.render.filepath = str(draft)
            bpy.ops.render.render(write_still=True)


def _triangles(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    try:
        vertices, faces = world_triangles(path)
    except (OSError, ValueError):
        return None
    return vertices, faces[:: max(len(faces) // _MOST, 1)]


def _add(scene: bpy.types.Scene, triangles: tuple[np.ndarray, np.ndarray] | None, label: str,
         place: tuple[float, float], clay: bpy.types.Material, ink: bpy.types.Material) -> None:
    """Put a mesh and its label in a square of unit size."""
    if triangles is not None:
        vertices, faces = triangles
        turned = vertices @ np.array(_TURN.to_matrix()).T
        low, high = turned.min(axis=0), turned.max(axis=0)
        turned = (turned - (low + high) / 2) / max(float((high - low)[:2].max()), 1e-30) * 0.88
        mesh = bpy.data.meshes.new("Level")
        mesh.from_pydata(turned, (), faces.tolist())
        mesh.materials.append(clay)
        obj = bpy.data.objects.new("Level", mesh)
        obj.location = (*place, 0)
        scene.collection.objects.link(obj)
    text = bpy.data.curves.new("Label", "FONT")
    text.body = label if len(label) < 32 else "…" + label[-31:]
    text.size, text.align_x = 0.062, "CENTER"
    text.materials.append(ink)
    obj = bpy.data.objects.new("Label", text)
    obj.location = (place[0], place[1] - 0.58, 0)
    scene.collection.objects.link(obj)


def _material(name: str, color: tuple[float, float, float], glow: float) -> bpy.types.Material:
    """Make a matt material, or one that has its colour in any light."""
    material = bpy.data.materials.new(name)
    tree = use_nodes(material)
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeEmission" if glow else "ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*color, 1)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _set_up(scene: bpy.types.Scene, width: float, height: float) -> None:
    """Add a camera that sees the grid, lights and paper."""
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale, camera.clip_end = "ORTHO", max(width, height), 100
    obj = bpy.data.objects.new("Camera", camera)
    obj.location = (width / 2, -height / 2, 50)
    scene.collection.objects.link(obj)
    scene.camera = obj
    light = bpy.data.lights.new("Key", "SUN")
    light.energy, light.angle = 2.3, radians(10)
    obj = bpy.data.objects.new("Key", light)
    obj.rotation_euler = (radians(38), radians(-28), 0)
    scene.collection.objects.link(obj)
    world = bpy.data.worlds.new("Paper")
    background = use_nodes(world).nodes["Background"]
    background.inputs["Color"].default_value = (0.9, 0.91, 0.93, 1)
    background.inputs["Strength"].default_value = 0.8
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = round(width * _CELL), round(height * _CELL)
    scene.render.image_settings.file_format = "PNG"
    scene.cycles.device, scene.cycles.samples, scene.cycles.max_bounces = "CPU", 6, 1
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
