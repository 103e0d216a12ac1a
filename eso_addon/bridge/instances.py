# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of collection instances: empties that instance collections of levels."""

from collections.abc import Callable, Iterable, Sequence

import bpy

from . import level_info
from .level_names import fitting_names, take_name
from .objects import SOURCE, level_collection

_OF = "eso_levels_of"  # a collection of levels: the name of the collection whose meshes they stand for


def instancers(things: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """List the empties that instance a collection of meshes, but for those that instance levels."""
    return [obj for obj in dict.fromkeys(things) if obj.type == "EMPTY" and obj.instance_collection is not None
            and level_info.LEVEL not in obj]


def place_instances(empties: Sequence[bpy.types.Object], name: Callable[[str, int], str],
                    scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Have empties for each level stand where the empties stand; those of before are used again.

    Parameters
    ----------
    empties : sequence of bpy.types.Object
        Whose meshes have levels already.
    name : callable
        Names a level after its object.
    scene : bpy.types.Scene

    Returns
    -------
    list of bpy.types.Object
    """
    made = []
    collections: dict[bpy.types.Collection, list[bpy.types.Collection]] = {}
    for empty in empties:
        inner = empty.instance_collection
        if inner not in collections:
            collections[inner] = _collections(inner, name)
        target = level_collection(fitting_names(empty.name, 1, lambda base, _: f"{base}_LODs")[0], scene)
        earlier = {obj[level_info.LEVEL]: obj for obj in bpy.data.objects
                   if obj.type == "EMPTY" and level_info.LEVEL in obj and obj.get(SOURCE) == empty.name}
        names = fitting_names(empty.name, len(collections[inner]), name)
        for number, collection in enumerate(collections[inner]):
            level = earlier.pop(number, None)
            if level is None:
                level = empty.copy()
                target.objects.link(level)
            level.instance_collection = collection
            level[SOURCE], level[level_info.LEVEL] = empty.name, number
            take_name(level, names[number], bpy.data.objects)
            made.append(level)
        for obj in earlier.values():
            bpy.data.objects.remove(obj)
    return made


def _collections(inner: bpy.types.Collection, name: Callable[[str, int], str]) -> list[bpy.types.Collection]:
    """Make a collection for each level, with that level of every mesh, or its last one."""
    chains = [levels for obj in inner.all_objects if obj.type == "MESH" and (levels := level_info.levels_of(obj))]
    most = max((len(levels) for levels in chains), default=0)
    found = []
    for number, wanted in enumerate(fitting_names(inner.name, most, name)):
        known = [c for c in bpy.data.collections if c.get(_OF) == inner.name and c.get(level_info.LEVEL) == number]
        collection = known[0] if known else bpy.data.collections.new(wanted)
        collection[_OF], collection[level_info.LEVEL] = inner.name, number
        collection.instance_offset = inner.instance_offset
        for obj in list(collection.objects):
            collection.objects.unlink(obj)
        for levels in chains:
            collection.objects.link(levels[min(number, len(levels) - 1)])
        found.append(collection)
    return found
