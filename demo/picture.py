# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet: every level side by side, flat shaded with its edges drawn; Cycles needs no screen."""

from collections.abc import Sequence
from math import ceil, radians
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Vector

from eso_addon.files.atomic import atomic_output

_COLUMNS = 3
_TURN = Euler((radians(90), 0, radians(-58)))  # the files' Y is up; seen from the front, a little to the side
_CLAY, _LINES, _PAPER, _INK = (0.80, 0.52, 0.32), (0.05, 0.03, 0.02), (0.93, 0.94, 0.95), (0.08, 0.09, 0.11)
_CELL = (1.28, 1.02)  # width and height of a cell in lengths of the mesh


def contact_sheet(
    path: Path, meshes: Sequence[tuple[str, bpy.types.Mesh]], width: int = 1500, *, tall: bool = False
) -> None:
    """Render meshes in a grid, each with its label below.

    Parameters
    ----------
    path
        The PNG to write.
    meshes
        Labels and meshes, Y up. They are shown in one scale, the first one's.
    width
        Pixels.
    tall
        The meshes are as high as they are long.
    """
    cell = (_CELL[0], _CELL[1] + 0.32) if tall else _CELL
    scene = bpy.data.scenes.new("Contact sheet")
    rows = ceil(len(meshes) / _COLUMNS)
    clay, ink = _clay(), _plain("Ink", _INK)
    size, centre = _frame(meshes[0][1])
    for index, (label, mesh) in enumerate(meshes):
        row, column = divmod(index, _COLUMNS)
        place = Vector(((column + 0.5) * cell[0], 0, -(row + 0.5) * cell[1]))
        _add_mesh(scene, mesh, clay, place, size, centre)
        _add_label(scene, label, ink, place - Vector((0, 0, 0.43 + (0.16 if tall else 0))))
    extent = (_COLUMNS * cell[0], rows * cell[1])
    _add_camera(scene, extent)
    _add_lights(scene)
    _set_up_render(scene, width, round(width * extent[1] / extent[0]))
    with atomic_output(path) as draft:
        scene.render.filepath = str(draft)
        bpy.ops.render.render(write_still=True, scene=scene.name)
    bpy.data.scenes.remove(scene)


def _frame(mesh: bpy.types.Mesh) -> tuple[float, Vector]:
    """Give the size and the middle of a mesh as it is turned to the camera."""
    matrix = np.array(_TURN.to_matrix())
    points = np.zeros(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    turned = points.reshape(-1, 3) @ matrix.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    return float(max(high - low)), Vector((low + high) / 2)


def _add_mesh(
    scene: bpy.types.Scene,
    mesh: bpy.types.Mesh,
    material: bpy.types.Material,
    place: Vector,
    size: float,
    centre: Vector,
) -> None:
    copy = mesh.copy()
    copy.materials.clear()
    copy.materials.append(material)
    copy.shade_flat()
    obj = bpy.data.objects.new(mesh.name, copy)
    obj.rotation_euler = _TURN
    obj.scale = (1 / size,) * 3
    obj.location = place + Vector((0, 0, 0.06)) - centre / size
    scene.collection.objects.link(obj)


def _add_label(scene: bpy.types.Scene, label: str, material: bpy.types.Material, place: Vector) -> None:
    curve = bpy.data.curves.new(label, "FONT")
    curve.body = label
    curve.size = 0.075
    curve.align_x = "CENTER"
    curve.materials.append(material)
    obj = bpy.data.objects.new(label, curve)
    obj.rotation_euler = (radians(90), 0, 0)
    obj.location = place
    obj.visible_shadow = obj.visible_diffuse = False
    scene.collection.objects.link(obj)


def _add_camera(scene: bpy.types.Scene, extent: tuple[float, float]) -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.type = "ORTHO"
    camera.ortho_scale = max(extent)
    obj = bpy.data.objects.new("Camera", camera)
    obj.location = (extent[0] / 2, -10, -extent[1] / 2)
    obj.rotation_euler = (radians(90), 0, 0)
    scene.collection.objects.link(obj)
    scene.camera = obj


def _add_lights(scene: bpy.types.Scene) -> None:
    for name, strength, angle, turn in (("Key", 2.9, 8, (52, 8, -38)), ("Rim", 1.1, 30, (70, 0, 130))):
        light = bpy.data.lights.new(name, "SUN")
        light.energy, light.angle = strength, radians(angle)
        obj = bpy.data.objects.new(name, light)
        obj.rotation_euler = tuple(map(radians, turn))
        scene.collection.objects.link(obj)


def _set_up_render(scene: bpy.types.Scene, width: int, height: int) -> None:
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = width, height
    render.film_transparent = False
    render.image_settings.file_format = "PNG"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 16
    scene.cycles.adaptive_threshold = 0.03
    scene.cycles.max_bounces = 1
    scene.cycles.use_denoising = False  # it would soften the lines
    scene.view_settings.view_transform = "Standard"
    scene.world = _world()


def _world() -> bpy.types.World:
    """Make a world that looks like paper to the camera, and lights softly."""
    world = bpy.data.worlds.new("Paper")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    seen, light = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeBackground")
    seen.inputs["Color"].default_value = (*_PAPER, 1)
    light.inputs["Color"].default_value = (0.75, 0.83, 1.0, 1)
    light.inputs["Strength"].default_value = 0.5
    ray, mix = nodes.new("ShaderNodeLightPath"), nodes.new("ShaderNodeMixShader")
    output = nodes.new("ShaderNodeOutputWorld")
    links.new(ray.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(light.outputs[0], mix.inputs[1])
    links.new(seen.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    return world


def _clay() -> bpy.types.Material:
    """Make a matt clay with the edges of triangles drawn on it."""
    material, nodes, links = _empty_material("Clay")
    wire, mix = nodes.new("ShaderNodeWireframe"), nodes.new("ShaderNodeMixShader")
    clay, line = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeBsdfDiffuse")
    wire.use_pixel_size = True
    wire.inputs["Size"].default_value = 0.8
    clay.inputs["Color"].default_value = (*_CLAY, 1)
    line.inputs["Color"].default_value = (*_LINES, 1)
    links.new(wire.outputs[0], mix.inputs[0])
    links.new(clay.outputs[0], mix.inputs[1])
    links.new(line.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["Output"].inputs["Surface"])
    return material


def _plain(name: str, color: tuple[float, float, float]) -> bpy.types.Material:
    """Make a material that has its colour in any light."""
    material, nodes, links = _empty_material(name)
    glow = nodes.new("ShaderNodeEmission")
    glow.inputs["Color"].default_value = (*color, 1)
    links.new(glow.outputs[0], nodes["Output"].inputs["Surface"])
    return material


def _empty_material(name: str) -> tuple[bpy.types.Material, bpy.types.Nodes, bpy.types.NodeLinks]:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial").name = "Output"
    return material, tree.nodes, tree.links
