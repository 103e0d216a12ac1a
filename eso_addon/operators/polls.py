# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether an operator can run, and if not, why: the same words in poll messages and in the panel."""

import bpy

from ..bridge import objects


def why_not_simplify(context: bpy.types.Context) -> str:
    """Say why the active object cannot be simplified; empty if it can."""
    obj = context.active_object
    if obj is None:
        return "No active object: select a mesh"
    if obj.type != "MESH":
        return f"'{obj.name}' is no mesh: convert it first (Object > Convert > Mesh)"
    if obj.mode not in {"OBJECT", "EDIT"}:
        return "Switch to Object Mode or Edit Mode first"
    if obj.mode == "OBJECT" and not obj.modifiers and not obj.data.polygons:
        return f"'{obj.name}' has no faces: nothing to simplify"
    return ""


def why_not_in_place(context: bpy.types.Context) -> str:
    """Say why the active mesh cannot be replaced; empty if it can."""
    return objects.why_not_in_place(context.active_object)


def active_triangles(context: bpy.types.Context, *, with_modifiers: bool) -> int:
    """Count the active mesh's triangles, quickly enough for drawing."""
    return objects.triangle_count(context.active_object, context.view_layer.depsgraph if with_modifiers else None)


def why_not_measure(context: bpy.types.Context) -> str:
    """Say why no two meshes can be compared; empty if they can."""
    obj = context.active_object
    if obj is None or obj.type != "MESH":
        return why_not_simplify(context)
    others = _others_to_measure(context)
    if len(others) > 1:
        return "Select only one mesh besides the active one"
    if not others and objects.source_of(obj) is None:
        return "Select the original, then the simplified mesh too"
    return ""


def measured_pair(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Give the original, which is the other selected mesh or the active one's source, and the active mesh."""
    obj = context.active_object
    others = _others_to_measure(context)
    return (others[0] if others else objects.source_of(obj)), obj


def poll_with(operator: type[bpy.types.Operator], reason: str) -> bool:
    """Answer a poll; the reason becomes its message."""
    if reason:
        operator.poll_message_set(reason)
    return not reason


def _others_to_measure(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the other selected meshes, but for levels of the same source: these are selected after they were made."""
    obj = context.active_object
    others = [other for other in context.selected_objects if other.type == "MESH" and other != obj]
    source = objects.source_of(obj)
    return [other for other in others if source is None or objects.source_of(other) != source]
