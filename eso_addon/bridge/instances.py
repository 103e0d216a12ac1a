# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of collection instances: empties that instance collections of levels."""

from collections.abc import Callable, Iterable, Sequence

import bpy

from . import level_info
from .copies import copied, follow
from .level_names import fitting_names, take_name
from .objects import SOURCE, level_collection

_OF = "eso_levels_of"  # a collection of levels: the name of the collection whose meshes they stand for


def is_instancer(obj: bpy.types.Object) -> bool:
    """Tell whether an object is an empty that instances a collection."""
    return obj.type == "EMPTY" and obj.instance_collection is not None


def instancers(things: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """List the empties that instance a collection, each once; one that was made as a level stands for its source."""
    found: dict[bpy.types.Object, None] = {}
    for obj in things:
        if is_instancer(obj):
            source = bpy.data.objects.get(str(obj.get(SOURCE, ""))) if level_info.LEVEL in obj else obj
            if source is not None and is_instancer(source):
                found[source] = None
    return list(found)


def inside(empty: bpy.types.Object) -> list[bpy.types.Object]:
    """List the objects that an empty instances, and those that instances among them instance in turn, each once."""
    found: dict[bpy.types.Object, None] = {}
    waiting, seen = [empty], set()
    while waiting:
        collection = waiting.pop().instance_collection
        if collection not in seen:
            seen.add(collection)
            found.update(dict.fromkeys(collection.all_objects))
            waiting += filter(is_instancer, collection.all_objects)
    return list(found)


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
    placing = _Placing(name, scene)
    return [level for empty in empties for level in placing.levels_of(empty)]


class _Placing:
    """Makes the levels of empties, and of the collections that they instance, each once."""

    def __init__(self, name: Callable[[str, int], str], scene: bpy.types.Scene) -> None:
        self._name, self._scene = name, scene
        self._collections: dict[bpy.types.Collection, list[bpy.types.Collection]] = {}
        self._made: dict[bpy.types.Object, list[bpy.types.Object]] = {}

    def levels_of(self, empty: bpy.types.Object) -> list[bpy.types.Object]:
        """Have an empty for each level that the instanced collection has."""
        if empty not in self._made:
            self._made[empty] = self._place(empty, self._collections_of(empty.instance_collection))
        return self._made[empty]

    def _place(self, empty: bpy.types.Object, shown: Sequence[bpy.types.Collection]) -> list[bpy.types.Object]:
        in_scene = empty in self._scene.objects.values()
        target = level_collection(fitting_names(empty.name, 1, lambda base, _: f"{base}_LODs")[0], self._scene,
                                  shown=in_scene)
        earlier = {obj[level_info.LEVEL]: obj for obj in bpy.data.objects
                   if obj.type == "EMPTY" and level_info.LEVEL in obj and obj.get(SOURCE) == empty.name}
        made = []
        for number, (collection, name) in enumerate(
                zip(shown, fitting_names(empty.name, len(shown), self._name), strict=True)):
            level = earlier.pop(number, None)
            if level is None:
                level = copied(empty, None, modifiers_applied=False)
                target.objects.link(level)
            else:
                follow(level, empty, modifiers_applied=False)
            level.instance_collection = collection
            level[SOURCE], level[level_info.LEVEL] = empty.name, number
            take_name(level, name, bpy.data.objects)
            made.append(level)
        for obj in earlier.values():
            bpy.data.objects.remove(obj)
        return made

    def _collections_of(self, inner: bpy.types.Collection) -> list[bpy.types.Collection]:
        """Have a collection for each level, with that level of all that is instanced, or its last one."""
        if inner in self._collections:
            return self._collections[inner]
        self._collections[inner] = []
        chains = [levels for obj in inner.all_objects if (levels := self._chain(obj))]
        most = max(map(len, chains), default=0)
        for number, wanted in enumerate(fitting_names(inner.name, most, self._name)):
            known = [c for c in bpy.data.collections if c.get(_OF) == inner.name and c.get(level_info.LEVEL) == number]
            collection = known[0] if known else bpy.data.collections.new(wanted)
            collection[_OF], collection[level_info.LEVEL] = inner.name, number
            collection.instance_offset = inner.instance_offset
            for obj in list(collection.objects):
                collection.objects.unlink(obj)
            for levels in chains:
                collection.objects.link(levels[min(number, len(levels) - 1)])
            self._collections[inner].append(collection)
        return self._collections[inner]

    def _chain(self, obj: bpy.types.Object) -> list[bpy.types.Object]:
        if is_instancer(obj) and level_info.LEVEL not in obj:
            return self.levels_of(obj)
        return level_info.levels_of(obj) if obj.type == "MESH" else []
