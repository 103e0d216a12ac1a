# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes for the tests of everything that touches Blender."""

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest


@pytest.fixture(autouse=True)
def empty_file() -> Iterator[None]:
    """Start each test in an empty file."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


@pytest.fixture
def addon() -> Iterator[None]:
    """Switch the add-on's Blender side on for one test."""
    from eso_addon import operators, settings, ui

    for part in (settings, operators, ui):
        part.register()
    yield
    for part in (ui, operators, settings):
        part.unregister()


def add_sphere(name: str = "Ball", subdivisions: int = 4) -> bpy.types.Object:
    """Add an icosphere that is active and selected."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions)
    return _named(name)


def add_cube(name: str = "Box") -> bpy.types.Object:
    """Add a cube that is active and selected."""
    bpy.ops.mesh.primitive_cube_add()
    return _named(name)


def add_mesh(name: str, vertices: list, faces: list, edges: list = ()) -> bpy.types.Object:  # type: ignore[assignment]
    """Add an object of these polygons that is active and selected."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, list(edges), faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    activate(obj)
    return obj


def linked_from_library(folder: Path, kind: str, name: str) -> bpy.types.ID:
    """Save this file as a library, start an empty one, and link one thing of the library into it."""
    path = str(folder / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, ours):
        setattr(ours, kind, [name])
    return getattr(bpy.data, kind)[name]


def activate(*objects: bpy.types.Object) -> None:
    """Select objects, the first of them active."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def arrays(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Give positions and triangle indices as Blender's plain calls give them."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    positions = np.array([vertex.co for vertex in mesh.vertices], np.float64).reshape(-1, 3)
    return positions, np.array([t.vertices for t in mesh.loop_triangles], np.int64).reshape(-1, 3)


def _named(name: str) -> bpy.types.Object:
    obj = bpy.context.object
    obj.name = obj.data.name = name
    return obj
