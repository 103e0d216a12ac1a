# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether levels can be made, made again, exported or baked, and if not, why."""

import bpy

from ..bridge import level_info
from .polls import why_not_simplify


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the active object and the selected ones."""
    return list(dict.fromkeys(obj for obj in (context.active_object, *context.selected_objects) if obj is not None))


def why_not_generate(context: bpy.types.Context) -> str:
    """Say why no levels can be made; empty if they can, as far as can be told before a scope is chosen."""
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        return "Switch to Object Mode or Edit Mode first"
    chosen = chosen_objects(context)
    if context.mode == "OBJECT" and any(map(_can_have_levels, chosen)):
        return ""
    if context.mode == "OBJECT" and context.active_object is None and _has_meshes(context.collection):
        return ""
    return why_not_simplify(context)


def why_not_update(context: bpy.types.Context) -> str:
    """Say why no levels can be made again; empty if they can."""
    if context.mode != "OBJECT":
        return "Switch to Object Mode first"
    if not any(level_info.is_level(obj) for obj in bpy.data.objects):
        return "No levels in this file: generate some first"
    return ""


def _can_have_levels(obj: bpy.types.Object) -> bool:
    if obj.type == "EMPTY":
        return obj.instance_collection is not None
    return obj.type == "MESH" and bool(obj.modifiers or obj.data.polygons)


def _has_meshes(collection: bpy.types.Collection) -> bool:
    return any(obj.type == "MESH" for obj in collection.all_objects)
