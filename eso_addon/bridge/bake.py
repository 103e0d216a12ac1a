# SPDX-License-Identifier: GPL-3.0-or-later
"""Normal maps of coarser levels, baked by Cycles from the finest, and materials that use them."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import bpy
import numpy as np

from ..core.mesh import MeshError
from .nodes import use_nodes
from .staging import staged

_NODE = "ESO LOD Normals"  # finds the nodes again when a map is baked anew


def why_not_bake(level: bpy.types.Object) -> str:
    """Say why a level cannot have a normal map; empty if it can."""
    if not level.data.uv_layers:
        return f"'{level.name}' has no UV map to bake into: give its source one (UV > Smart UV Project)"
    if not level.data.polygons:
        return f"'{level.name}' has no faces to bake"
    if "cycles" not in bpy.context.preferences.addons:
        return "Cycles is switched off: turn it on in Preferences > Add-ons to bake"
    return ""


def bake_normals(finest: bpy.types.Object, level: bpy.types.Object, size: int, reach: float,
                 samples: int = 16) -> bpy.types.Image:
    """Bake the finest level's normals into a map of a coarser one, in tangent space, and have its materials use it.

    Parameters
    ----------
    finest, level : bpy.types.Object
        Of the same object, in the same place.
    size : int
        Pixels along each side.
    reach : float
        How far the surfaces are apart at most.
    samples : int
        Of each pixel.

    Returns
    -------
    bpy.types.Image
        Packed into the file; the earlier one, if there was one.

    Raises
    ------
    MeshError
        The level has no UV map, or Blender cannot bake.
    """
    if reason := why_not_bake(level):
        raise MeshError(reason)
    image = _image(f"{level.name}_Normals", size)
    with ExitStack() as stack:
        stack.enter_context(staged("eso_lod bake", {finest: finest.name, level: level.name}, {}))
        for obj in (finest, level):
            stack.enter_context(_as_stored(obj))
        stack.enter_context(_in_one_tile(level.data))
        before = list(level.data.materials)
        targets = _own_materials(level, image)
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.samples = samples
        scene.cycles.device = "CPU"
        bpy.context.view_layer.objects.active = level
        try:
            bpy.ops.object.bake(type="NORMAL", use_selected_to_active=True, max_ray_distance=2 * reach,
                                cage_extrusion=reach, margin=max(size // 128, 2), normal_space="TANGENT",
                                use_clear=True)
        except RuntimeError as error:
            level.data.materials.clear()
            for material in before:
                level.data.materials.append(material)
            raise MeshError(f"Blender cannot bake '{level.name}': {' '.join(str(error).split())}") from None
    for material in targets:
        _use(material, image)
    image.pack()
    return image


def _image(name: str, size: int) -> bpy.types.Image:
    image = bpy.data.images.get(name)
    if image is not None and tuple(image.size) != (size, size):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(name, size, size, alpha=False, float_buffer=False)
    image.colorspace_settings.name = "Non-Color"
    return image


def _own_materials(level: bpy.types.Object, image: bpy.types.Image) -> list[bpy.types.Material]:
    """Give a level materials that it need not share, with the image as the active node, into which Blender bakes."""
    mesh = level.data
    if not mesh.materials:
        mesh.materials.append(None)
    own: dict[bpy.types.Material | None, bpy.types.Material] = {}
    for slot, material in enumerate(list(mesh.materials)):
        if material not in own:
            own[material] = material if material is not None and material.get(_NODE) == mesh.name else \
                _copied(material, level)
            own[material][_NODE] = mesh.name
        mesh.materials[slot] = own[material]
    made = list(own.values())
    for material in made:
        nodes = material.node_tree.nodes
        node = nodes.get(_NODE) or nodes.new("ShaderNodeTexImage")
        node.name = node.label = _NODE
        node.image = image
        node.select = True
        nodes.active = node
        for link in [link for link in material.node_tree.links if link.from_node == node]:
            material.node_tree.links.remove(link)  # what is baked cannot be seen meanwhile
    return made


def _copied(material: bpy.types.Material | None, level: bpy.types.Object) -> bpy.types.Material:
    copy = bpy.data.materials.new(level.name) if material is None else material.copy()
    copy.name = f"{level.name if material is None else material.name}_{level.name}"
    use_nodes(copy)
    return copy


def _use(material: bpy.types.Material, image: bpy.types.Image) -> None:
    """Have a material's surface take its normals from the image."""
    tree = material.node_tree
    texture = tree.nodes[_NODE]
    texture.image = image
    shaders = [node for node in tree.nodes if "Normal" in node.inputs and node.bl_idname.startswith("ShaderNodeBsdf")]
    mapper = tree.nodes.get(f"{_NODE} Map") or tree.nodes.new("ShaderNodeNormalMap")
    mapper.name = f"{_NODE} Map"
    tree.links.new(texture.outputs["Color"], mapper.inputs["Color"])
    for shader in shaders:
        tree.links.new(mapper.outputs["Normal"], shader.inputs["Normal"])
        texture.location = shader.location.x - 600, shader.location.y - 400
        mapper.location = shader.location.x - 250, shader.location.y - 400


@contextmanager
def _in_one_tile(mesh: bpy.types.Mesh) -> Iterator[None]:
    """Move faces whose UVs lie in other tiles of a repeated texture into the first one, where Blender bakes."""
    layer = (mesh.uv_layers.active or mesh.uv_layers[0]).uv
    before = np.zeros(len(layer) * 2, np.float32)
    layer.foreach_get("vector", before)
    sizes = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    uv = before.reshape(-1, 2)
    starts = np.cumsum(sizes) - sizes
    tile = np.floor(np.add.reduceat(uv, starts, axis=0) / sizes[:, None])
    try:
        layer.foreach_set("vector", (uv - np.repeat(tile, sizes, axis=0)).ravel())
        mesh.update()
        yield
    finally:
        layer.foreach_set("vector", before)
        mesh.update()


@contextmanager
def _as_stored(obj: bpy.types.Object) -> Iterator[None]:
    """Show an object at rest: what moves it moves both levels the same way."""
    shown = [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE" and modifier.show_render]
    try:
        for modifier in shown:
            modifier.show_render = False
        yield
    finally:
        for modifier in shown:
            modifier.show_render = True
