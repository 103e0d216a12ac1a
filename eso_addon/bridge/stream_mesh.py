# SPDX-License-Identifier: GPL-3.0-or-later
"""One Blender mesh with all that it holds as what a stream holds, and back, exactly."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..progressive.polygons import (
    DIAGONAL,
    GROUP,
    KEY,
    NORMALS,
    STORED_NORMALS,
    find_polygons,
    is_apart,
    mark_polygons,
)
from ..progressive.progressive import Level
from .active_layers import read_active, write_active
from .attributes import ATTRIBUTE_TYPES, read_attribute, write_attribute
from .layers import read_layers
from .shape_keys import add_keys, key_entries, points_of, timing_of
from .vertex_groups import fill_group, read_weights

Attributes = dict[str, dict[str, NDArray]]
_DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face", "EDGE": "side"}
_BACK = {"vertex": "POINT", "corner": "CORNER", "face": "FACE", "side": "EDGE"}
# directions that differ by less are the same, within what Blender's 16 bits can tell
_SAME = 1e-3
# of what Blender gives a meaning, type and domain are fixed
_BUILT_IN = {"material_index": ("INT", "FACE"), "sharp_face": ("BOOLEAN", "FACE"), "sharp_edge": ("BOOLEAN", "EDGE"),
             "uv_seam": ("BOOLEAN", "EDGE"), "crease_edge": ("FLOAT", "EDGE"), "crease_vert": ("FLOAT", "POINT"),
             "custom_normal": ("", "")}


@dataclass
class StreamMesh:
    """What `progressive` takes, and what else there is to say of a mesh."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.int64]
    edges: NDArray[np.int64]
    attributes: Attributes
    meta: dict[str, Any]
    left_behind: list[str] = field(default_factory=list)


def read_stream_mesh(mesh: bpy.types.Mesh, obj: bpy.types.Object, *, keep_order: bool) -> StreamMesh:
    """Read a mesh; `obj` names its vertex groups.

    Parameters
    ----------
    mesh : bpy.types.Mesh
        Stored or evaluated.
    obj : bpy.types.Object
        What shows it, or as it is evaluated: geometry nodes may bring vertex groups.
    keep_order : bool
        Tell which corner of each polygon is its first.
    """
    positions = read_attribute(mesh, "position")
    vertices = np.zeros((0, 3), np.float32) if positions is None else positions
    corner_vertex, corner_edge = (_integers(mesh, name, len(mesh.loops)) for name in (".corner_vert", ".corner_edge"))
    mesh.calc_loop_triangles()
    corners = _got(mesh.loop_triangles, "loops", 3 * len(mesh.loop_triangles)).reshape(-1, 3)
    polygon = _got(mesh.loop_triangle_polygons, "value", len(mesh.loop_triangles))
    starts = np.append(_got(mesh.polygons, "loop_start", len(mesh.polygons)), len(corner_vertex))
    faces = corner_vertex.take(corners)
    loose = np.flatnonzero(np.bincount(corner_edge, minlength=len(mesh.edges)) == 0)
    ends = _integers(mesh, ".edge_verts", 2 * len(mesh.edges)).reshape(-1, 2)
    result = StreamMesh(vertices, faces, ends.take(loose, axis=0),
                        mark_polygons(faces, corners, polygon, starts, keep_order=keep_order),
                        {"name": mesh.name, "types": {}})
    local = corners - starts.take(polygon)[:, None]
    size = np.diff(starts).take(polygon)[:, None]
    inside = (local + 1) % size != np.roll(local, -1, axis=1)
    _read_layers(result, mesh, corners, polygon, np.where(inside, -1, corner_edge.take(corners)), loose)
    _read_normals(result, mesh, corners)
    _read_groups(result, mesh, obj)
    result.meta.update(read_active(mesh))
    return result


def _got(items: Any, name: str, count: int) -> NDArray[np.int64]:  # noqa: ANN401 - a collection of Blender's
    values = np.zeros(count, np.int32)
    items.foreach_get(name, values)
    return values.astype(np.int64)


def _integers(mesh: bpy.types.Mesh, name: str, count: int) -> NDArray[np.int64]:
    values = read_attribute(mesh, name)
    return np.zeros(count, np.int64) if values is None else values.ravel().astype(np.int64)


def _read_layers(result: StreamMesh, mesh: bpy.types.Mesh, corners: NDArray, polygon: NDArray, side_edge: NDArray,
                 loose: NDArray) -> None:
    for layer in read_layers(mesh):
        if layer.data_type == "STRING" or is_apart(layer.name):
            result.left_behind.append(f"attribute {layer.name}")
            continue
        values = layer.values
        if layer.data_type == "BYTE_COLOR":
            values = _bytes_of_color(mesh, layer.name, len(values))
        result.meta["types"][f"{_DOMAINS[layer.domain]} {layer.name}"] = layer.data_type
        if layer.domain == "EDGE":
            shown = values.take(side_edge.clip(min=0), axis=0)
            shown[side_edge < 0] = 0
            result.attributes.setdefault("edge", {})[layer.name] = values.take(loose, axis=0)
        else:
            at = {"POINT": None, "CORNER": corners, "FACE": polygon}[layer.domain]
            shown = values if at is None else values.take(at, axis=0)
        result.attributes.setdefault(_DOMAINS[layer.domain], {})[layer.name] = shown


def _bytes_of_color(mesh: bpy.types.Mesh, name: str, count: int) -> NDArray[np.uint8]:
    colors = np.zeros(4 * count, np.float32)
    mesh.attributes[name].data.foreach_get("color_srgb", colors)
    return np.rint(colors * 255).astype(np.uint8).reshape(-1, 4)


def _read_normals(result: StreamMesh, mesh: bpy.types.Mesh, corners: NDArray) -> None:
    """Read custom normals: free ones as they are stored, others as the directions that they mean."""
    if not mesh.has_custom_normals:
        return
    normals = np.zeros(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    result.attributes.setdefault("corner", {})[NORMALS] = normals.reshape(-1, 3).take(corners, axis=0)
    stored = mesh.attributes.get("custom_normal")  # since 4.5
    if stored is not None and stored.domain == "CORNER":
        values = read_attribute(mesh, "custom_normal")
        assert values is not None
        free = stored.data_type == "FLOAT_VECTOR"
        result.meta["free_normals"] = free
        result.attributes["corner"][NORMALS if free else STORED_NORMALS] = values.take(corners, axis=0)


def _read_groups(result: StreamMesh, mesh: bpy.types.Mesh, obj: bpy.types.Object) -> None:
    """Read vertex groups: weights, -1 where a vertex is not in a group."""
    groups = obj.vertex_groups
    if not len(groups):
        return
    weights = read_weights(mesh, len(groups), absent=-1)
    result.meta["groups"] = [group.name for group in groups]
    result.meta["groups_locked"] = [group.lock_weight for group in groups]
    named = result.attributes.setdefault("vertex", {})
    for number in range(len(groups)):
        named[f"{GROUP}{number}"] = np.ascontiguousarray(weights[:, number])


def read_keys(result: StreamMesh, mesh: bpy.types.Mesh) -> None:
    """Read the shape keys of a stored mesh."""
    keys = mesh.shape_keys
    if keys is None:
        return
    result.meta["keys"], result.meta["keys_timing"] = key_entries(keys), timing_of(keys)
    named = result.attributes.setdefault("vertex", {})
    for number, block in enumerate(keys.key_blocks):
        named[f"{KEY}{number}"] = points_of(block)
    animation = keys.animation_data
    if animation is not None and (animation.action is not None or len(animation.drivers) or len(animation.nla_tracks)):
        result.left_behind.append("animation and drivers of shape keys")


def write_stream_mesh(level: Level, meta: dict[str, Any], name: str) -> bpy.types.Mesh:
    """Make a mesh of a level; groups and shape keys come with `write_owned`, materials by its slots.

    Parameters
    ----------
    level : Level
    meta : dict
        As `read_stream_mesh` gave it; of another writer, whatever is there is used.
    name : str
    """
    mesh = bpy.data.meshes.new(name)
    faces = level.faces.astype(np.int64)
    attributes = {domain: dict(named) for domain, named in level.attributes.items()}
    if DIAGONAL in attributes.get("side", {}) and level.moved.any():
        attributes["side"][DIAGONAL] = attributes["side"][DIAGONAL] & ~level.moved[:, None]
    slots, starts = find_polygons(faces, attributes)
    mesh.vertices.add(len(level.vertices))
    if len(level.vertices):
        write_attribute(mesh, "position", "FLOAT_VECTOR", "POINT", level.vertices)
    if len(level.edges):
        mesh.edges.add(len(level.edges))
        write_attribute(mesh, ".edge_verts", "INT32_2D", "EDGE", level.edges)
    if len(slots):
        mesh.loops.add(len(slots))
        mesh.polygons.add(len(starts) - 1)
        write_attribute(mesh, ".corner_vert", "INT", "CORNER", faces.ravel().take(slots))
        mesh.polygons.foreach_set("loop_start", starts[:-1].astype(np.int32))
    mesh.update(calc_edges=True)
    _write_layers(mesh, level, meta, slots, starts)
    _write_normals(mesh, level, meta, slots)
    write_active(mesh, meta)
    if len(faces) and _damaged(faces):
        mesh.validate()
    return mesh


def _damaged(faces: NDArray[np.int64]) -> bool:
    """Tell whether a face has one vertex twice, which Blender does not bear."""
    return bool((faces == np.roll(faces, 1, axis=1)).any())


def _write_layers(mesh: bpy.types.Mesh, level: Level, meta: dict[str, Any], slots: NDArray, starts: NDArray) -> None:
    types = meta.get("types")
    types = types if isinstance(types, dict) else {}
    sources = {"vertex": np.arange(len(level.vertices)), "corner": slots,
               "face": slots.take(starts[:-1]) // 3, "side": slots}
    for domain, at in sources.items():
        for name, array in level.attributes.get(domain, {}).items():
            if is_apart(name):
                continue
            rows = array.reshape(-1, *array.shape[2:]) if domain in ("corner", "side") else array
            data_type = _data_type(str(types.get(f"{domain} {name}", "")), rows)
            if data_type is None:
                continue
            values = rows.take(at, axis=0)
            if domain == "side":
                values = _at_edges(mesh, values, level.edges, level.attributes.get("edge", {}).get(name))
            _write(mesh, name, data_type, _BACK[domain], values)


def _data_type(told: str, rows: NDArray) -> str | None:
    """Return Blender's type of an attribute; None where it has none."""
    width = int(np.prod(rows.shape[1:], dtype=int))
    if told == "BYTE_COLOR" and rows.dtype == np.uint8 and width == 4:
        return told
    for name in (told, *ATTRIBUTE_TYPES):
        kind = ATTRIBUTE_TYPES.get(name)
        if kind is not None and name != "BYTE_COLOR" and np.dtype(kind.dtype) == rows.dtype and kind.width == width:
            return name
    if rows.dtype.kind in "iu" and width == 1:
        return "INT"
    if rows.dtype.kind == "f" and width in (1, 2, 3, 4):
        return ("FLOAT", "FLOAT2", "FLOAT_VECTOR", "FLOAT_COLOR")[width - 1]
    return None


def _write(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str, values: NDArray) -> None:
    """Write an attribute; one of a name that is there already, as the mesh's own are, stays out."""
    if name in mesh.attributes or _BUILT_IN.get(name, (data_type, domain)) != (data_type, domain):
        return
    if name == "material_index":
        values = values.clip(0, np.iinfo(np.int16).max)
    if data_type == "BYTE_COLOR":
        attribute = mesh.attributes.new(name, data_type, domain)
        attribute.data.foreach_set("color_srgb", values.astype(np.float32).ravel() / np.float32(255))
        return
    write_attribute(mesh, name, data_type, domain, values)


def _at_edges(mesh: bpy.types.Mesh, values: NDArray, loose: NDArray, loose_values: NDArray | None) -> NDArray:
    """Put values of the corners' sides, and of loose edges, in the order of the mesh's edges."""
    out = np.zeros((len(mesh.edges), *values.shape[1:]), values.dtype)
    out[_integers(mesh, ".corner_edge", len(mesh.loops))] = values
    if loose_values is not None and len(loose):
        count = len(mesh.vertices)
        ends = np.sort(_integers(mesh, ".edge_verts", 2 * len(mesh.edges)).reshape(-1, 2), axis=1)
        keys = ends[:, 0] * count + ends[:, 1]
        order = np.argsort(keys, kind="stable")
        pairs = np.sort(loose.astype(np.int64), axis=1)
        wanted = pairs[:, 0] * count + pairs[:, 1]
        place = order.take(np.searchsorted(keys, wanted, sorter=order).clip(max=len(keys) - 1))
        there = keys.take(place) == wanted
        out[place[there]] = loose_values[there]
    return out


def _write_normals(mesh: bpy.types.Mesh, level: Level, meta: dict[str, Any], slots: NDArray) -> None:
    normals = level.attributes.get("corner", {}).get(NORMALS)
    if normals is None or len(slots) == 0 or normals.shape[2:] != (3,):
        return
    values = normals.reshape(-1, 3).take(slots, axis=0)
    if meta.get("free_normals") is True and bpy.app.version >= (4, 5, 0):
        write_attribute(mesh, "custom_normal", "FLOAT_VECTOR", "CORNER", values)
        return
    stored = level.attributes["corner"].get(STORED_NORMALS)
    if stored is not None and stored.shape[2:] == (2,) and bpy.app.version >= (4, 5, 0) and not level.moved.any():
        write_attribute(mesh, "custom_normal", "INT16_2D", "CORNER", stored.reshape(-1, 2).take(slots, axis=0))
        found = np.zeros(values.size, np.float32)
        mesh.corner_normals.foreach_get("vector", found)
        if np.abs(found - values.ravel()).max() < _SAME:  # they mean directions only with the faces in their order
            return
        mesh.attributes.remove(mesh.attributes["custom_normal"])
    mesh.normals_split_custom_set(values)


def write_owned(obj: bpy.types.Object, level: Level, meta: dict[str, Any]) -> None:
    """Write vertex groups and shape keys to an object whose mesh has just been made."""
    named = level.attributes.get("vertex", {})
    groups, locked = (_list(meta.get(key)) for key in ("groups", "groups_locked"))
    obj.vertex_groups.clear()
    for number, name in enumerate(groups):
        group = obj.vertex_groups.new(name=str(name))
        group.lock_weight = locked[number:number + 1] == [True]
        weights = named.get(f"{GROUP}{number}")
        if weights is not None and weights.ndim == 1:
            fill_group(group, weights, np.flatnonzero(weights >= 0))
    keys = _list(meta.get("keys"))
    shapes = [named.get(f"{KEY}{number}") for number in range(len(keys))]
    if all(isinstance(key, dict) for key in keys):
        there = [shape for shape in shapes if shape is not None and shape.shape[1:] == (3,)]
        timing = meta.get("keys_timing")
        if len(there) == len(keys):
            add_keys(obj, there, keys, timing if isinstance(timing, dict) else {})


def _list(value: Any) -> list:  # noqa: ANN401 - from a file
    return value if isinstance(value, list) else []
