# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplified meshes as objects of the scene: beside their source, in its place, or as levels in a collection."""

from collections.abc import Collection, Iterable, Mapping

import bpy

from ..core.errors import MeshError
from .copies import copied
from .modifiers import keep_modifiers

# Custom properties of a result, for scripts and exporters.
SOURCE, TRIANGLES, RATIO, ERROR = "eso_source", "eso_triangles", "eso_ratio", "eso_error"


def triangle_count(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph | None = None) -> int:
    """Count the triangles of a mesh object without making them; with modifiers if a depsgraph is given."""
    mesh = obj.data
    if depsgraph is not None and obj.mode != "EDIT":
        evaluated = obj.evaluated_get(depsgraph)
        mesh = evaluated.data if isinstance(evaluated.data, bpy.types.Mesh) else mesh
    return len(mesh.loops) - 2 * len(mesh.polygons)


def source_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Find the mesh object that a result was made from, None if it has none or that is gone."""
    source = bpy.data.objects.get(str(obj.get(SOURCE, "")))
    return source if source is not None and source.type == "MESH" and source != obj else None


def add_object(
    source: bpy.types.Object,
    mesh: bpy.types.Mesh,
    name: str,
    collections: Iterable[bpy.types.Collection],
    *,
    modifiers_applied: bool,
    properties: Mapping[str, object],
    live: Collection[str] = (),
) -> bpy.types.Object:
    """Add an object that stands where its source stands.

    Parameters
    ----------
    source : bpy.types.Object
        Left as it is; see `copied` for what is taken over.
    mesh : bpy.types.Mesh
    name : str
    collections : iterable of bpy.types.Collection
        Where the object is linked.
    modifiers_applied : bool
        The mesh has the modifiers in it already, so that the object goes without.
    properties : mapping
        Custom properties of the new object.
    live : collection of str
        Names of modifiers that are not in the mesh, and stay.

    Returns
    -------
    bpy.types.Object
    """
    obj = copied(source, mesh, modifiers_applied=modifiers_applied, live=live)
    obj.name = name
    for key, value in properties.items():
        obj[key] = value
    for collection in collections:
        collection.objects.link(obj)
    return obj


def collections_for(source: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """List the collections of an object that take new objects; the scene's own if none does."""
    ours = [*scene.collection.children_recursive, scene.collection]
    editable = [c for c in source.users_collection if c in ours and c.library is None and c.override_library is None]
    return editable or [scene.collection]


def level_collection(name: str, scene: bpy.types.Scene, *, shown: bool = True) -> bpy.types.Collection:
    """Find the collection of this name in the scene, or add it there; one that is not to be shown stays outside."""
    known = {collection.name: collection for collection in scene.collection.children_recursive}
    collection = known.get(name) or bpy.data.collections.get((name, None))
    if collection is None:
        collection = bpy.data.collections.new(name)
    if collection.library is not None:
        raise MeshError(f"collection '{name}' is linked from another file: choose another name")
    if shown and collection.name not in known:
        scene.collection.children.link(collection)
    return collection


def why_not_in_place(obj: bpy.types.Object) -> str:
    """Say why an object's mesh cannot be replaced; empty if it can."""
    if obj.library is not None or obj.data.library is not None:
        return f"'{obj.name}' is linked from another file: make it local first (Object > Relations > Make Local)"
    if obj.override_library is not None:
        return f"'{obj.name}' is a library override: make it local first (Object > Relations > Make Local)"
    return ""


def replace_mesh(
    obj: bpy.types.Object,
    mesh: bpy.types.Mesh,
    *,
    modifiers_applied: bool,
    all_users: bool = False,
    live: Collection[str] = (),
) -> None:
    """Put a new mesh in the place of an object's own.

    Parameters
    ----------
    obj : bpy.types.Object
    mesh : bpy.types.Mesh
        Takes the old one's name if nothing else uses that.
    modifiers_applied : bool
        The mesh has the modifiers in it already, so that they are removed.
    all_users : bool
        The other objects that share the old mesh get the new one too; their modifiers are the same.
    live : collection of str
        Names of modifiers that are not in the mesh, and stay.

    Raises
    ------
    MeshError
        The object or its mesh belongs to another file.
    """
    reason = why_not_in_place(obj)
    if reason:
        raise MeshError(reason)
    old = obj.data
    users = [other for other in bpy.data.objects if other.data == old] if all_users else [obj]
    if all_users:
        old.user_remap(mesh)
    obj.data = mesh
    for user in users if modifiers_applied else ():
        keep_modifiers(user, live)
    if old.users == 0:
        name = old.name
        bpy.data.meshes.remove(old)
        mesh.name = name


def result_properties(source: bpy.types.Object, before: int, after: int, error: float | None) -> dict[str, object]:
    """Give the custom properties of a result: its source's name, triangles, their share, and the error if known."""
    known = {} if error is None else {ERROR: error}
    return {SOURCE: source.name, TRIANGLES: after, RATIO: after / max(before, 1), **known}


def leave_edit_mode(obj: bpy.types.Object) -> None:
    """Switch from Edit Mode to Object Mode: what is done to objects in Edit Mode cannot be undone."""
    if obj.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def join_local_view(objects: Iterable[bpy.types.Object], space: bpy.types.Space | None) -> None:
    """Show objects in a viewport that is in Local View; they would be missing there otherwise."""
    if isinstance(space, bpy.types.SpaceView3D) and space.local_view is not None:
        for obj in objects:
            obj.local_view_set(space, True)


def hide(objects: Iterable[bpy.types.Object], view_layer: bpy.types.ViewLayer) -> None:
    """Hide objects in the viewports, as far as the view layer has them; without a window there is nothing to hide."""
    for obj in objects if not bpy.app.background else ():
        if view_layer.objects.get(obj.name) == obj:
            obj.hide_set(True, view_layer=view_layer)


def select_only(objects: list[bpy.types.Object], view_layer: bpy.types.ViewLayer) -> None:
    """Select objects, the first of them active, and nothing else, as far as the view layer shows them."""
    view_layer.update()  # else it does not know objects that were just linked
    shown = [obj for obj in objects if obj.name in view_layer.objects]
    if not shown:
        return
    for obj in list(view_layer.objects.selected):
        obj.select_set(False)
    for obj in shown:
        obj.select_set(True)
    view_layer.objects.active = shown[0]
