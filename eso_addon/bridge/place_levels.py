# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels as objects in a collection: new ones beside their source, or made again in the place of earlier ones."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from ..core.errors import MeshError
from . import level_info, objects
from .copies import follow, note_modifiers
from .level_names import check_free, fitting_names, take_name
from .objects import SOURCE


@dataclass(frozen=True)
class LevelMesh:
    """The mesh of a level, and what is told of it."""

    mesh: bpy.types.Mesh
    properties: Mapping[str, object]


@dataclass(frozen=True)
class Place:
    """Where the levels of one object go; nothing is made yet.

    Attributes
    ----------
    source
        What the levels are made from.
    names
        Of the levels, the finest first; as many as the chain may have.
    earlier
        Objects that are made again, by level; copies that the user made of them are left alone.
    collection
        The name of the collection.
    """

    source: bpy.types.Object
    names: list[str]
    earlier: dict[int, bpy.types.Object]
    collection: str


def plan_places(sources: Sequence[bpy.types.Object], count: int, name: Callable[[str, int], str], *,
                collection: str = "", replace: bool = True) -> list[Place]:
    """Find names and places for the levels of several objects, or say why there are none.

    Parameters
    ----------
    sources : sequence of bpy.types.Object
    count : int
        Levels of each.
    name : callable
        Names a level after its object: a profile's.
    collection : str
        Where all levels go; without it each object's go to a collection named after it.
    replace : bool
        Earlier levels of the same object are made again.

    Raises
    ------
    MeshError
        A name is taken, or the collection is another file's.
    """
    places, names, ours = [], [], []
    for source in sources:
        wanted = collection or fitting_names(source.name, 1, lambda base, _: f"{base}_LODs")[0]
        linked = bpy.data.collections.get(wanted)
        if linked is not None and linked.library is not None and bpy.data.collections.get((wanted, None)) is None:
            raise MeshError(f"collection '{wanted}' is linked from another file: choose another name")
        earlier = [obj for obj in level_info.levels_of(source) if obj.library is None and obj.override_library is None]
        ours += earlier
        here = [obj for obj in earlier if wanted in {c.name for c in obj.users_collection}] or earlier
        by_level = {obj[level_info.LEVEL]: obj for obj in reversed(here)} if replace else {}
        place = Place(source, fitting_names(source.name, count, name), by_level, wanted)
        places.append(place)
        names += place.names
    check_free(names, ours)
    return places


def place_levels(place: Place, levels: Sequence[LevelMesh], scene: bpy.types.Scene, *, modifiers_applied: bool,
                 live: Sequence[str] = ()) -> list[bpy.types.Object]:
    """Put the levels of one object into the scene.

    Parameters
    ----------
    place : Place
    levels : sequence of LevelMesh
        The finest first; a mesh may be that of several objects.
    scene : bpy.types.Scene
    modifiers_applied : bool
        The meshes have the modifiers in them, but for the live ones.
    live : sequence of str
        Names of modifiers that stay.

    Returns
    -------
    list of bpy.types.Object
    """
    # What a scene shows through instances alone has its levels where these find them, and nowhere else.
    shown = place.source in scene.objects.values()
    collection = objects.level_collection(place.collection, scene, shown=shown)
    for obj in [obj for number, obj in place.earlier.items() if number >= len(levels)]:
        remove_with_mesh(obj)
    placed = []
    for number, level in enumerate(levels):
        obj = place.earlier.get(number)
        if obj is None:
            obj = objects.add_object(place.source, level.mesh, place.names[number], [collection],
                                     modifiers_applied=modifiers_applied, live=live, properties={})
            note_modifiers(obj)
        else:
            put_mesh(obj, level.mesh)
            follow(obj, place.source, modifiers_applied=modifiers_applied, live=live)
            _move_to(obj, collection)
        for key, value in level.properties.items():
            obj[key] = value
        take_name(obj, place.names[number], bpy.data.objects)
        placed.append(obj)
    return placed


def put_mesh(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    """Put a new mesh in the place of a level's; what shares the old one gets it too, but for levels of other sources,
    which may show something else by now. Materials changed there stay.
    """
    old, source = obj.data, obj.get(SOURCE)
    if old == mesh:
        return
    _keep_changed_materials(old, mesh)
    for user in [user for user in bpy.data.objects if user.data == old]:
        if not level_info.is_level(user) or user[SOURCE] == source:
            user.data = mesh
    name = old.name
    if not old.users:
        bpy.data.meshes.remove(old)
    mesh.name = name


def remove_with_mesh(obj: bpy.types.Object) -> None:
    """Remove an object, and its mesh if nothing else uses that."""
    mesh = obj.data
    bpy.data.objects.remove(obj)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)


MATERIALS = "eso_materials"  # of a level's mesh: the names that its slots had when it was made


def note_materials(mesh: bpy.types.Mesh) -> None:
    """Remember a level's materials, so that later it can be told which ones the user changed."""
    mesh[MATERIALS] = "\n".join(material.name if material else "" for material in mesh.materials)


def _keep_changed_materials(old: bpy.types.Mesh, new: bpy.types.Mesh) -> None:
    made_with = str(old.get(MATERIALS, "")).split("\n")
    for slot, material in enumerate(old.materials):
        was = made_with[slot] if slot < len(made_with) else None
        if (material.name if material else "") != was:
            if slot >= len(new.materials):
                new.materials.append(material)
            new.materials[slot] = material


def _move_to(obj: bpy.types.Object, collection: bpy.types.Collection) -> None:
    if collection in obj.users_collection:
        return
    for other in obj.users_collection:
        other.objects.unlink(obj)
    collection.objects.link(obj)
