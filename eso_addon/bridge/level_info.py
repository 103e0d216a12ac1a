# SPDX-License-Identifier: GPL-3.0-or-later
"""What a level knows about itself: custom properties, for the panel, for scripts, and to make it again."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from .fingerprint import fingerprint
from .objects import ERROR, RATIO, SOURCE, TRIANGLES

LEVEL = "eso_level"  # 0 is the finest
DISTANCE = "eso_switch_distance"  # from here on the level can be shown
PROFILE = "eso_profile"
SETTINGS = "eso_settings"  # JSON: how the levels were made
HASH = "eso_source_hash"
MESH = "eso_source_mesh"  # finds a source that was renamed
STALE = "eso_stale"  # the source was edited since
MESSAGE = "eso_message"  # what could not be done
HULL = "eso_hull"  # a collision hull, counted from 1


def is_level(obj: bpy.types.Object) -> bool:
    """Tell whether an object is a level of detail."""
    return obj.type == "MESH" and SOURCE in obj and LEVEL in obj


def is_hull(obj: bpy.types.Object) -> bool:
    """Tell whether an object is a collision hull made from another."""
    return obj.type == "MESH" and SOURCE in obj and HULL in obj


def levels_of(source: bpy.types.Object) -> list[bpy.types.Object]:
    """List the levels made from an object, the finest first."""
    found = [obj for obj in bpy.data.objects if is_level(obj) and _is_made_from(obj, source)]
    return sorted(found, key=lambda obj: (obj[LEVEL], obj.name))


@dataclass(frozen=True)
class Family:
    """What was made from one object.

    Attributes
    ----------
    name : str
        The source's, or the one that it had, if it is gone.
    source : bpy.types.Object or None
    levels, hulls : list of bpy.types.Object
        The finest first; each level once: copies that the user made of it do not count.
    """

    name: str
    source: bpy.types.Object | None
    levels: list[bpy.types.Object]
    hulls: list[bpy.types.Object]


def families(things: Iterable[bpy.types.Object] | None = None) -> list[Family]:
    """Gather levels and hulls by what they were made from, whether that is still there or not.

    Parameters
    ----------
    things : iterable of bpy.types.Object, optional
        Sources, levels and hulls whose families are wanted, in this order; all that have levels by default.
    """
    levels: dict[bpy.types.Object | str, dict[int, bpy.types.Object]] = {}
    hulls: dict[bpy.types.Object | str, dict[int, bpy.types.Object]] = {}
    for obj in sorted(bpy.data.objects, key=lambda obj: obj.name):
        if is_level(obj):
            levels.setdefault(_origin(obj), {}).setdefault(obj[LEVEL], obj)
        elif is_hull(obj):
            hulls.setdefault(_origin(obj), {}).setdefault(obj[HULL], obj)
    wanted = levels if things is None else dict.fromkeys(map(_origin, things))
    return [Family(origin if isinstance(origin, str) else origin.name, None if isinstance(origin, str) else origin,
                   _in_order(levels[origin]), _in_order(hulls.get(origin, {})))
            for origin in wanted if origin in levels]


def _in_order(numbered: Mapping[int, bpy.types.Object]) -> list[bpy.types.Object]:
    return [numbered[number] for number in sorted(numbered)]


def _origin(obj: bpy.types.Object) -> bpy.types.Object | str:
    """Give what an object was made from, the name of that if it is gone, or the object itself if it is a source."""
    if not is_level(obj) and not is_hull(obj):
        return obj
    return find_source(obj) or str(obj[SOURCE])


def find_source(level: bpy.types.Object) -> bpy.types.Object | None:
    """Find what a level was made from, by its name or, if it was renamed, by its mesh; None if it is gone."""
    named = bpy.data.objects.get(str(level.get(SOURCE, "")))
    if _can_be_source(named, level):
        return named
    mesh = bpy.data.meshes.get(str(level.get(MESH, "")))
    if mesh is None:
        return None
    taken = {str(obj[SOURCE]) for obj in bpy.data.objects if SOURCE in obj}
    users = [obj for obj in bpy.data.objects
             if obj.data == mesh and LEVEL not in obj and obj.name not in taken and _can_be_source(obj, level)]
    return users[0] if len(users) == 1 else None


def _is_made_from(made: bpy.types.Object, source: bpy.types.Object) -> bool:
    """Tell whether the source is this one; most are told apart by their names, without a search."""
    if made[SOURCE] != source.name and made.get(MESH) != source.data.name:
        return False
    return find_source(made) == source


def _can_be_source(obj: bpy.types.Object | None, level: bpy.types.Object) -> bool:
    """Tell whether an object may be what a level was made from; only one of another source may be a level itself."""
    return (obj is not None and obj.type == "MESH" and obj != level
            and not (LEVEL in obj and obj.get(SOURCE) == level.get(SOURCE)))


def stale_ones(levels: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Return the levels whose source was edited after they were made; each source is looked at once."""
    now: dict[bpy.types.Object, str] = {}
    found = []
    for level in levels:
        source = find_source(level)
        if source is None or HASH not in level:
            continue
        if source not in now:
            now[source] = fingerprint(source)
        if level[HASH] != now[source]:
            found.append(level)
    return found


def level_properties(source: bpy.types.Object, level: int, before: int, after: int, error: float, distance: float,
                     message: str) -> dict[str, object]:
    """Give the custom properties of a level that belong to it alone."""
    return {SOURCE: source.name, MESH: source.data.name, LEVEL: level, TRIANGLES: after, RATIO: after / max(before, 1),
            ERROR: float(error), DISTANCE: float(distance), MESSAGE: message, STALE: False}


def settings_text(settings: Mapping[str, Any]) -> str:
    """Write settings as one line of JSON."""
    import json

    return json.dumps(dict(settings), sort_keys=True)


def settings_of(level: bpy.types.Object) -> dict[str, Any] | None:
    """Read the settings of a level, None if it has none that can be read."""
    import json

    try:
        settings = json.loads(str(level.get(SETTINGS, "")))
    except ValueError:
        return None
    return settings if isinstance(settings, dict) else None
