# SPDX-License-Identifier: GPL-3.0-or-later
"""Names for levels and hulls that Blender can hold and that nothing else has."""

from collections.abc import Callable, Collection, Sequence

import bpy

from ..core.errors import MeshError

# Blender cuts longer names without a word, the level's number first.
MOST_BYTES = 255 if bpy.app.version >= (5, 0) else 63


def fitting_names(base: str, count: int, name: Callable[[str, int], str]) -> list[str]:
    """Name things after one base, which is cut as far as the longest name needs.

    Parameters
    ----------
    base : str
    count : int
    name : callable
        Gives the name of each from the base and the number of the thing.
    """
    for cut in range(len(base), 0, -1):
        names = [name(base[:cut], number) for number in range(count)]
        if max((len(text.encode()) for text in names), default=0) <= MOST_BYTES:
            return names
    raise MeshError(f"no name fits for the levels of '{base}': rename it")


def check_free(names: Sequence[str], allowed: Collection[bpy.types.Object]) -> None:
    """Make sure that new objects get their names.

    Parameters
    ----------
    names : sequence of str
    allowed : collection of bpy.types.Object
        Objects that may have such names, since they go or are made again.

    Raises
    ------
    MeshError
        Two of the names are the same, or another object has one of them.
    """
    if len(set(names)) < len(names):
        twice = next(name for number, name in enumerate(names) if name in names[:number])
        raise MeshError(f"two objects would be named '{twice}': rename one of the sources")
    for name in names:
        other = bpy.data.objects.get((name, None))
        if other is not None and other not in allowed and other.users:
            raise MeshError(f"an object named '{name}' is there already: rename or delete it, then try again")


def take_name(thing: bpy.types.ID, name: str, things: bpy.types.bpy_prop_collection) -> None:
    """Give something a name; what nobody uses any more must let go of it."""
    other = things.get((name, None))
    if other is not None and other != thing and not other.users:
        other.name = f"{name[:40]}.unused"
    thing.name = name
