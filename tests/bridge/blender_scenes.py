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


def add_scaling_nodes(*objects: bpy.types.Object) -> None:
    """Give objects a Geometry Nodes modifier whose input scales the mesh; see `set_scale`."""
    tree = bpy.data.node_groups.new("Scale", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Scale", in_out="INPUT", socket_type="NodeSocketFloat")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    scale = tree.nodes.new("GeometryNodeTransform")
    tree.links.new(start.outputs["Geometry"], scale.inputs["Geometry"])
    tree.links.new(start.outputs["Scale"], scale.inputs["Scale"])
    tree.links.new(scale.outputs["Geometry"], end.inputs["Geometry"])
    for obj in objects:
        obj.modifiers.new("Scale", "NODES").node_group = tree
        set_scale(obj, 1.0)


def set_scale(obj: bpy.types.Object, scale: float) -> None:
    """Set what `add_scaling_nodes` scales an object by."""
    modifier = obj.modifiers["Scale"]
    name = next(socket.identifier for socket in modifier.node_group.interface.items_tree if socket.name == "Scale")
    bpy.context.view_layer.update()  # since Blender 5.2 it makes the inputs
    if bpy.app.version < (5, 2):
        modifier[name] = scale
    else:
        getattr(modifier.properties.inputs, name).value = scale
    obj.update_tag()
    bpy.context.view_layer.update()


def add_empty(name: str) -> bpy.types.Object:
    """Add an empty."""
    empty = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(empty)
    return empty


def add_twin(obj: bpy.types.Object, name: str) -> bpy.types.Object:
    """Add an object that shares another's mesh, without its modifiers."""
    twin = bpy.data.objects.new(name, obj.data)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.update()
    return twin


def add_rig(name: str = "Rig") -> bpy.types.Object:
    """Add an armature of one bone, called Bone, that points up."""
    rig = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(rig)
    activate(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("Bone").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def _named(name: str) -> bpy.types.Object:
    obj = bpy.context.object
    obj.name = obj.data.name = name
    return obj
