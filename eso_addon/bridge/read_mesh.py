# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh object as arrays: triangles as Blender makes them, in the size that the object has in the scene."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.attributes import Attribute
from ..core.mesh import MeshError
from .active_layers import read_active
from .attributes import read_attribute
from .layers import Layer, at_corners, for_engine, read_layers
from .left_behind import lost_with_modifiers, unknown_attributes
from .modifiers import switched_off
from .selection import is_part_selected, marked_faces, marked_selection, selected_faces
from .shape_keys import ShapeKeys, read_keys, with_shapes
from .vertex_groups import VertexGroups, read_groups


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """What is read of a mesh object; materials, `template` and the keys' source are references to Blender's data."""

    vertices: NDArray[np.float64]  # (n, 3), after `transform`
    triangles: NDArray[np.int64]  # (m, 3) vertex indices
    triangle_corners: NDArray[np.int64]  # (m, 3) corner indices
    triangle_polygon: NDArray[np.int64]  # (m,)
    polygon_sizes: NDArray[np.int64]  # (p,) corners of each polygon
    edges: NDArray[np.int64]  # (e, 2) vertex indices
    wires: NDArray[np.int64]  # edges of no face
    material_index: NDArray[np.int32]  # (m,)
    smooth: NDArray[np.bool_]  # (m,)
    transform: NDArray[np.float64]  # (4, 4), object space to the space of `vertices`
    materials: tuple["bpy.types.Material | None", ...]
    left_behind: tuple[str, ...]  # data that simplified meshes lose, by name
    template: bpy.types.Mesh  # for what a mesh has besides elements
    selected: NDArray[np.bool_] | None = None  # (m,); None where all faces are, or none is, or nobody asked
    layers: tuple[Layer, ...] = ()
    active: dict[str, str] | None = None  # names of active and rendered layers
    normals: NDArray[np.float32] | None = None  # (corners, 3) custom normals
    free_normals: bool = False  # how Blender stores them
    groups: VertexGroups | None = None
    keys: ShapeKeys | None = None

    @property
    def carried(self) -> dict[str, Any]:
        """What the mesh carries, as options of the engine."""
        # what is rendered comes first: of each kind it is what enters the engine's cost
        shown = {name for which, name in (self.active or {}).items() if which.endswith("_render")}
        layers = tuple(sorted(self.layers, key=lambda layer: layer.name not in shown))
        attributes = for_engine(layers, self.triangle_corners, self.triangle_polygon)
        if self.normals is not None:
            attributes[NORMALS] = Attribute(at_corners(self.normals, self.triangle_corners), "corner", "normal")
        if self.groups is not None:
            attributes[GROUPS] = Attribute(self.groups.weights, "vertex", "value")
        if self.keys is not None:
            attributes[KEYS] = Attribute(self.keys.offsets.transpose(1, 0, 2), "vertex", "value")
        return {"attributes": attributes, "edges": self.edges} if attributes else {}


# What these are called beside the mesh's own attributes, whose names cannot hold this character.
NORMALS, GROUPS, KEYS = "\0custom normals", "\0vertex groups", "\0shape keys"


def read_mesh(
    obj: bpy.types.Object,
    *,
    apply_modifiers: bool = True,
    live: Collection[str] = (),
    depsgraph: bpy.types.Depsgraph | None = None,
    transform: NDArray[np.float64] | None = None,
    carry: bool = False,
    selection: bool = False,
) -> MeshArrays:
    """Read a mesh object, in Edit Mode too.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object; may be linked or hidden.
    apply_modifiers : bool
        Read the mesh as modifiers leave it, not as it is stored.
    live : collection of str
        Names of modifiers that are not to be in what is read; only with `carry`.
    depsgraph : bpy.types.Depsgraph, optional
        Where modifiers are evaluated; the context's by default.
    transform : ndarray, (4, 4) float64, optional
        Put on the vertices. By default the scale part of the object's world matrix, so that lengths are the scene's.
    carry : bool
        Read all that the mesh carries, and the neutral shape of a mesh with shape keys; without it only the shape,
        with its keys as they are mixed now.
    selection : bool
        Read which faces are selected; the object is in Edit Mode.

    Returns
    -------
    MeshArrays

    Raises
    ------
    MeshError
        Not a mesh, a scale of zero, modifiers that Blender does not evaluate, or that lose the selection.
    """
    if obj.type != "MESH":
        raise MeshError(f"'{obj.name}' is no mesh: convert it first (Object > Convert > Mesh)")
    if transform is None:
        transform = scale_transform(obj)
    if obj.data.is_editmode:
        obj.update_from_editmode()
    with switched_off(obj, live) if carry else nullcontext():
        lost = lost_with_modifiers(obj, applied=apply_modifiers, live=live) if carry else []
        if apply_modifiers and (_has_modifiers(obj) or (not carry and obj.data.shape_keys is not None)):
            return _read_evaluated(obj, transform, depsgraph, lost, carry=carry, selection=selection)
        with stored_mesh(obj) as mesh:
            selected = selected_faces(mesh) if selection and is_part_selected(mesh) else None
            keys = read_keys(obj.data) if carry else None
            return _arrays_of(obj, mesh, transform, keys, obj if carry else None, lost, selected)


def _has_modifiers(obj: bpy.types.Object) -> bool:
    return any(modifier.show_viewport for modifier in obj.modifiers)


def _read_evaluated(obj: bpy.types.Object, transform: NDArray[np.float64], depsgraph: bpy.types.Depsgraph | None,
                    lost: list[str], *, carry: bool, selection: bool) -> MeshArrays:
    """Read a mesh as modifiers leave it."""
    if selection:
        with stored_mesh(obj) as mesh:
            selection = is_part_selected(mesh)
    keys = read_keys(obj.data) if carry else None
    with marked_selection(obj) if selection else nullcontext():
        depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
        neutral = None if keys is None else 0
        if keys is not None:
            keys = _evaluated_keys(obj, keys, depsgraph, lost)
        with _shown_key(obj, neutral), evaluated_mesh(obj, depsgraph) as mesh:
            selected = marked_faces(mesh) if selection else None
            owner = obj.evaluated_get(depsgraph) if carry else None
            return _arrays_of(obj, mesh, transform, keys, owner, lost, selected)


@contextmanager
def _shown_key(obj: bpy.types.Object, number: int | None) -> Iterator[None]:
    """Have Blender evaluate an object with one of its shape keys alone, the whole of it."""
    if number is None:
        yield
        return
    key = obj.data.shape_keys.key_blocks[number]
    before = obj.show_only_shape_key, obj.active_shape_key_index, key.mute, key.vertex_group
    try:
        obj.show_only_shape_key, obj.active_shape_key_index = True, number
        # a muted key would show the neutral shape, one with a vertex group a part of itself
        key.mute, key.vertex_group = False, ""
        bpy.context.view_layer.update()
        yield
    finally:
        obj.show_only_shape_key, obj.active_shape_key_index, key.mute, key.vertex_group = before
        bpy.context.view_layer.update()


def _evaluated_keys(obj: bpy.types.Object, keys: ShapeKeys, depsgraph: bpy.types.Depsgraph,
                    lost: list[str]) -> ShapeKeys | None:
    """Read shape keys as modifiers leave them; if these do not leave all of them the same vertices, note the loss."""
    shapes = []
    for number in range(len(keys.names)):
        with _shown_key(obj, number), evaluated_mesh(obj, depsgraph) as mesh:
            positions = read_attribute(mesh, "position")
            shapes.append(np.zeros((0, 3), np.float32) if positions is None else positions)
    if len({len(shape) for shape in shapes}) > 1:
        lost.append(f"shape keys ({', '.join(keys.names)}): modifiers make another mesh of each")
        return None
    return with_shapes(keys, np.stack(shapes))


def scale_transform(obj: bpy.types.Object) -> NDArray[np.float64]:
    """Give the scale part of an object's world matrix, mirrored or sheared by parents or not.

    Parameters
    ----------
    obj : bpy.types.Object

    Returns
    -------
    transform : ndarray, (4, 4) float64
        The stretch P of the polar decomposition R P; exactly the identity for an object that is not scaled.

    Raises
    ------
    MeshError
        A scale of zero, or one that is not finite.
    """
    linear = np.array(obj.matrix_world, dtype=np.float64)[:3, :3]
    scales = np.zeros(3)
    if np.isfinite(linear).all():
        _, scales, axes = np.linalg.svd(linear)
    if scales.min() <= 1e-12 * max(scales.max(), 1e-30):
        raise MeshError(f"'{obj.name}' has a scale of zero: give it a size first (Object > Clear > Scale)")
    transform = np.eye(4)
    # Blender's matrices are float32: what is within their noise of no scale, is none.
    if np.abs(scales - 1).max() > 2e-6:
        transform[:3, :3] = axes.T @ (scales[:, None] * axes)
    return transform


@contextmanager
def evaluated_mesh(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.Mesh]:
    """Give an object's mesh as modifiers leave it."""
    evaluated = obj.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        raise MeshError(
            f"'{obj.name}' is disabled in the viewport, so its modifiers are not evaluated: "
            "enable it (monitor icon in the Outliner) or turn Apply Modifiers off"
        )
    mesh = evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    if mesh is None:
        raise MeshError(f"'{obj.name}' gives no mesh: check its modifiers")
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


@contextmanager
def stored_mesh(obj: bpy.types.Object) -> Iterator[bpy.types.Mesh]:
    """Give an object's mesh as it is stored, with all attributes, in Edit Mode too."""
    if not obj.data.is_editmode:
        yield obj.data
        return
    try:  # in Edit Mode the mesh itself shows no attributes, a copy of it does
        yield obj.to_mesh(preserve_all_data_layers=False)
    finally:
        obj.to_mesh_clear()


def _arrays_of(obj: bpy.types.Object, mesh: bpy.types.Mesh, transform: NDArray[np.float64], keys: ShapeKeys | None,
               owner: bpy.types.Object | None, lost: list[str], selected: NDArray[np.bool_] | None) -> MeshArrays:
    """Read a mesh that an object shows; with its owner, the object or as it is evaluated, all that it carries."""
    corners, polygon = _triangulated(mesh)
    corner_vertex = _read_or(mesh, ".corner_vert", len(mesh.loops), np.int32)
    positions = read_attribute(mesh, "position")
    vertices = np.zeros((0, 3)) if positions is None else positions.astype(np.float64)
    if keys is not None and len(keys.offsets[0]) == len(vertices) and mesh == obj.data:
        vertices = keys.neutral.astype(np.float64)
    if not np.array_equal(transform, np.eye(4)):
        vertices = vertices @ transform[:3, :3].T + transform[:3, 3]
    material = _read_or(mesh, "material_index", len(mesh.polygons), np.int32)
    sharp = _read_or(mesh, "sharp_face", len(mesh.polygons), np.bool_)
    edges = read_attribute(mesh, ".edge_verts")
    sizes = np.bincount(polygon, minlength=len(mesh.polygons)) + 2
    return MeshArrays(
        vertices=vertices,
        triangles=corner_vertex[corners].astype(np.int64).reshape(-1, 3),
        triangle_corners=corners.astype(np.int64).reshape(-1, 3),
        triangle_polygon=polygon.astype(np.int64),
        polygon_sizes=sizes,
        edges=np.zeros((0, 2), np.int64) if edges is None else edges.astype(np.int64),
        wires=_wires(mesh),
        material_index=material[polygon],
        smooth=~sharp[polygon],
        transform=transform,
        materials=tuple(material and material.original for material in mesh.materials),
        left_behind=(*unknown_attributes(mesh), *lost),
        template=obj.data,
        selected=None if selected is None else selected[polygon],
        **(_carried_of(obj, mesh, keys, owner) if owner is not None else {}),
    )


def _carried_of(obj: bpy.types.Object, mesh: bpy.types.Mesh, keys: ShapeKeys | None,
                owner: bpy.types.Object) -> dict[str, Any]:
    """Read what a mesh carries."""
    normals = None
    if mesh.has_custom_normals:
        normals = np.zeros(len(mesh.loops) * 3, np.float32)
        mesh.corner_normals.foreach_get("vector", normals)
        normals = normals.reshape(-1, 3)
    custom = mesh.attributes.get("custom_normal")
    return {
        "layers": read_layers(mesh),
        "active": read_active(mesh),
        "normals": normals,
        "free_normals": custom is not None and custom.data_type == "FLOAT_VECTOR",
        "groups": read_groups(obj, mesh, owner),
        "keys": keys,
    }


def _triangulated(mesh: bpy.types.Mesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Give the corners of Blender's triangles, (m * 3,), and the polygon of each, (m,)."""
    if len(mesh.loops) == 3 * len(mesh.polygons):  # triangles already: what Blender would say, a good deal sooner
        return np.arange(len(mesh.loops), dtype=np.int32), np.arange(len(mesh.polygons), dtype=np.int32)
    mesh.calc_loop_triangles()
    corners = np.zeros(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    polygon = np.zeros(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    return corners, polygon


def _wires(mesh: bpy.types.Mesh) -> NDArray[np.int64]:
    """List the edges of no face."""
    alone = np.ones(len(mesh.edges), bool)
    alone[_read_or(mesh, ".corner_edge", 0, np.int32)] = False
    return np.flatnonzero(alone)


def _read_or(mesh: bpy.types.Mesh, name: str, count: int, dtype: type) -> NDArray:
    """Read an attribute that Blender leaves out where it is zero everywhere."""
    values = read_attribute(mesh, name)
    return np.zeros(count, dtype) if values is None else values
