# SPDX-License-Identifier: GPL-3.0-or-later
"""What is told of each level in the list: what it has if it was made, else what it would have."""

import bpy

from ..bridge import level_info, objects
from .polls import active_triangles, why_not_simplify


def level_figures(context: bpy.types.Context) -> list[str]:
    """Give a short text for each level of the active object, the finest first; quickly enough for drawing."""
    obj, settings = context.active_object, context.scene.eso_lod
    if obj is None or obj.type != "MESH":
        return []
    source = level_info.find_source(obj) if level_info.is_level(obj) else obj
    made = level_info.levels_of(source) if source is not None else []
    if made:
        return [_made(level) for level in made]
    if settings.levels_by not in {"ratio", "count"} or why_not_simplify(context) or context.mode != "OBJECT":
        return []
    now = active_triangles(context, with_modifiers=settings.apply_modifiers)
    values = settings.level_values()
    counts = [now * value for value in values] if settings.levels_by == "ratio" else values
    return [f"{min(round(count), now):,}" for count in counts]


def _made(level: bpy.types.Object) -> str:
    error = level.get(objects.ERROR)
    return f"{level.get(objects.TRIANGLES, 0):,}" + ("" if error is None else f"  ±{error:.2g}")
