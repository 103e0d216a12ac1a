# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of the scene as a progressive stream of several meshes, and levels of it as objects again."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.mesh import MeshError
from ..core.steps import scaled
from ..progressive.progressive import Level, progressive_steps
from ..progressive.scene import Scene, load_scene
from .left_behind import lost_with_modifiers
from .nodes import use_nodes
from .read_mesh import evaluated_mesh, stored_mesh
from .stream_mesh import StreamMesh, read_keys, read_stream_mesh, write_owned, write_stream_mesh


def mesh_objects(context: bpy.types.Context, *, selected: bool) -> list[bpy.types.Object]:
    """List the mesh objects that are selected, or those that a user sees."""
    return [obj for obj in context.view_layer.objects
            if obj.type == "MESH" and (obj.select_get() if selected else obj.visible_get())]


def read_objects(objects: Sequence[bpy.types.Object], *, apply_modifiers: bool = True,
                 keep_order: bool = False) -> tuple[list[StreamMesh], dict[str, Any]]:
    """Read objects: the meshes, each once however many objects show it, and the file's `meta`.

    Parameters
    ----------
    objects : sequence of bpy.types.Object
        Meshes; others are left out.
    apply_modifiers : bool
        Read meshes as modifiers leave them.
    keep_order : bool
        See `read_stream_mesh`.

    Raises
    ------
    MeshError
        There is no mesh among them.
    """
    meshes: list[StreamMesh] = []
    known: dict[object, int] = {}
    materials: list[bpy.types.Material] = []
    entries = []
    for obj in objects:
        if obj.type != "MESH":
            continue
        if obj.data.is_editmode:
            obj.update_from_editmode()
        changed = apply_modifiers and any(modifier.show_viewport for modifier in obj.modifiers)
        key = obj if changed else (obj.data, tuple(group.name for group in obj.vertex_groups))
        if key not in known:
            known[key] = len(meshes)
            meshes.append(_read(obj, changed=changed, keep_order=keep_order))
            meshes[-1].left_behind += lost_with_modifiers(obj, applied=apply_modifiers, stay=False)
            meshes[-1].meta["materials"] = _numbers(obj.data.materials, materials)
        entry = {"name": obj.name, "mesh": known[key], "matrix": np.array(obj.matrix_world).ravel().tolist()}
        if any(slot.link == "OBJECT" for slot in obj.material_slots):
            entry["materials"] = _numbers([slot.material for slot in obj.material_slots], materials)
        entries.append(entry)
    if not meshes:
        raise MeshError("there is no mesh object to write: select one, or turn Selected Only off")
    return meshes, {"objects": entries, "materials": [_material_entry(material) for material in materials]}


def _read(obj: bpy.types.Object, *, changed: bool, keep_order: bool) -> StreamMesh:
    shown: AbstractContextManager[bpy.types.Mesh]
    owner = obj
    if changed:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        shown, owner = evaluated_mesh(obj, depsgraph), obj.evaluated_get(depsgraph)
    else:
        shown = stored_mesh(obj) if obj.data.is_editmode else nullcontext(obj.data)
    with shown as mesh:
        result = read_stream_mesh(mesh, owner, keep_order=keep_order)
    result.meta["name"] = obj.data.name
    if not changed:
        read_keys(result, obj.data)
    elif obj.data.shape_keys is not None:
        result.left_behind.append(f"shape keys of {obj.name}, which has modifiers")
    return result


def _numbers(slots: Iterable[bpy.types.Material | None], materials: list[bpy.types.Material]) -> list[int | None]:
    """Return the number of each slot's material in the list, which grows."""
    numbers: list[int | None] = []
    for material in slots:
        if material is not None and material not in materials:
            materials.append(material)
        numbers.append(None if material is None else materials.index(material))
    return numbers


def _material_entry(material: bpy.types.Material) -> dict[str, Any]:
    shader = _principled(material)
    color = material.diffuse_color if shader is None else shader.inputs["Base Color"].default_value
    return {"name": material.name, "color": [round(float(value), 6) for value in color]}


def _principled(material: bpy.types.Material) -> bpy.types.ShaderNode | None:
    nodes = material.node_tree.nodes if material.node_tree else ()
    return next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)


def stream_steps(meshes: Sequence[StreamMesh], meta: dict[str, Any],
                 options: dict[str, Any]) -> Generator[float, None, Scene]:
    """Make the stream of what was read; yields progress from 0 to 1. Touches nothing of Blender's.

    Parameters
    ----------
    meshes, meta
        As `read_objects` gives them.
    options : dict
        Of `progressive`.
    """
    total = sum(len(mesh.faces) + 1 for mesh in meshes)
    done = 0
    made = []
    for mesh in meshes:
        steps = progressive_steps(mesh.vertices, mesh.faces, attributes=mesh.attributes, edges=mesh.edges,
                                  meta=mesh.meta, **options)
        begun, count = done, len(mesh.faces)
        made.append((yield from scaled(steps, lambda part, begun=begun, count=count: (begun + part * count) / total)))
        done += len(mesh.faces) + 1
    return Scene(made, meta)


def add_objects(scene: Scene, levels: Sequence[Level], collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Add the objects of a stream at some levels, one of each of its meshes; return them in the file's order."""
    materials = [_material(entry) for entry in _list(scene.meta.get("materials"))]
    objects: list[bpy.types.Object] = []
    made: dict[int, bpy.types.Mesh] = {}
    entries = scene.meta.get("objects")
    if not entries:
        entries = [{"name": _name(mesh.meta, number), "mesh": number, "matrix": np.eye(4).ravel().tolist()}
                   for number, mesh in enumerate(scene.meshes)]
    for entry in entries:
        number = entry["mesh"]
        meta = scene.meshes[number].meta
        fresh = number not in made
        if fresh:
            made[number] = _mesh(scene, number, levels[number], materials)
        obj = bpy.data.objects.new(entry["name"], made[number])
        if fresh:
            write_owned(obj, levels[number], meta)
        else:
            for name in _list(meta.get("groups")):  # weights are with the mesh
                obj.vertex_groups.new(name=str(name))
        for slot, material in zip(obj.material_slots, _chosen(_list(entry.get("materials")), materials), strict=False):
            slot.link, slot.material = "OBJECT", material
        collection.objects.link(obj)
        obj.matrix_world = Matrix(np.array(entry["matrix"]).reshape(4, 4).tolist())
        objects.append(obj)
    return objects


def replace_level(obj: bpy.types.Object, scene: Scene, number: int, level: Level) -> None:
    """Give all objects that show a mesh of a stream another level of it."""
    old = obj.data
    keep = list(old.materials)
    users = [other for other in bpy.data.objects if other.data is old]
    fresh = write_stream_mesh(level, scene.meshes[number].meta, old.name)
    for material in keep:
        fresh.materials.append(material)
    for index, other in enumerate(users):
        other.data = fresh
        if index == 0:
            write_owned(other, level, scene.meshes[number].meta)
    name = old.name
    if old.users == 0:
        bpy.data.meshes.remove(old)
    fresh.name = name


def _mesh(scene: Scene, number: int, level: Level, materials: list[bpy.types.Material | None]) -> bpy.types.Mesh:
    meta = scene.meshes[number].meta
    mesh = write_stream_mesh(level, meta, _name(meta, number))
    for material in _chosen(_list(meta.get("materials")), materials):
        mesh.materials.append(material)
    return mesh


def _name(meta: dict[str, Any], number: int) -> str:
    name = meta.get("name")
    return name if isinstance(name, str) and name else f"Stream {number + 1}"


def _list(value: Any) -> list:  # noqa: ANN401 - from a file
    return value if isinstance(value, list) else []


def _chosen(numbers: list, materials: list[bpy.types.Material | None]) -> list[bpy.types.Material | None]:
    return [materials[number] if type(number) is int and 0 <= number < len(materials) else None for number in numbers]


def _material(entry: Any) -> bpy.types.Material | None:  # noqa: ANN401 - from a file
    """Find a material by its name, or make one of its colour."""
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
        return None
    known = bpy.data.materials.get(entry["name"])
    if known is not None:
        return known
    material = bpy.data.materials.new(entry["name"])
    color = entry.get("color")
    if isinstance(color, list) and len(color) == 4 and all(isinstance(value, (int, float)) for value in color):
        material.diffuse_color = color
        use_nodes(material)
        shader = _principled(material)
        if shader is not None:
            shader.inputs["Base Color"].default_value = color
    return material


_loaded: dict[Path, tuple[tuple[float, int], Scene]] = {}


def loaded_scene(path: Path, *, partial: bool = False) -> Scene:
    """Read a stream, or give the last one again if its file has not changed."""
    stat = path.stat()
    stamp = stat.st_mtime, stat.st_size
    known = _loaded.get(path)
    if known is None or known[0] != stamp or (known[1].damage and not partial):
        scene = load_scene(path, partial=partial)
        _loaded.clear()  # one is enough for a slider
        _loaded[path] = stamp, scene
    return _loaded[path][1]
