# SPDX-License-Identifier: GPL-3.0-or-later
"""Names what a mesh object loses in its simplified versions and in streams; every report says it."""

from collections.abc import Collection

import bpy

from .layers import unreadable
from .modifiers import is_bound


def unknown_attributes(mesh: bpy.types.Mesh) -> list[str]:
    """Name the attributes whose type this version does not know, such as ``["attributes (Cells)"]``."""
    return _named("attributes", unreadable(mesh))


def lost_with_modifiers(obj: bpy.types.Object, *, applied: bool, live: Collection[str] = (),
                        stay: bool = True) -> list[str]:
    """Name what goes with the modifiers of an object.

    Parameters
    ----------
    obj : bpy.types.Object
    applied : bool
        Modifiers go into the mesh.
    live : collection of str
        Names of those that stay nevertheless.
    stay : bool
        Modifiers that do not go into the mesh stay, on a mesh with other vertices; there are none in a stream.
    """
    if not applied and not stay:
        return _named("modifiers", [modifier.name for modifier in obj.modifiers])
    if not applied:
        detail = [modifier.name for modifier in obj.modifiers if modifier.type == "MULTIRES" and modifier.total_levels]
        bound = [modifier.name for modifier in obj.modifiers if is_bound(modifier)]
        return [*_named("what was sculpted on levels", detail), *_named("the binding of modifiers", bound)]
    off = [modifier.name for modifier in obj.modifiers if not modifier.show_viewport and modifier.name not in live]
    instances = [modifier.name for modifier in obj.modifiers if modifier.type == "NODES" and modifier.show_viewport]
    if instances and not _makes_instances(obj):
        instances = []
    return [*_named("modifiers that are off in the viewport", off),
            *_named("instances, which Realize Instances would make part of the mesh", instances)]


def _named(kind: str, names: Collection[str]) -> list[str]:
    return [f"{kind} ({', '.join(names)})"] if names else []


def _makes_instances(obj: bpy.types.Object) -> bool:
    """Tell whether geometry nodes give an object instances, or curves and points, beside its mesh."""
    if obj.instance_type != "NONE":  # these are its children's, and stay
        return False
    return any(instance.is_instance and instance.particle_system is None and instance.parent is not None
               and instance.parent.original == obj
               for instance in bpy.context.evaluated_depsgraph_get().object_instances)
