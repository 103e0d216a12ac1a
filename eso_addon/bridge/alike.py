# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects of one mesh can share what is made from it: those that show the same, whatever their modifiers say."""

from collections.abc import Collection, Iterable, Sequence
from contextlib import ExitStack

import bpy

from .fingerprint import digest_of_layers, modifier_settings, settings_of_modifier
from .modifiers import live_modifiers, switched_off
from .read_mesh import evaluated_mesh


def alike(objects: Iterable[bpy.types.Object], *, apply_modifiers: bool,
          live_types: Collection[str]) -> list[list[bpy.types.Object]]:
    """Group mesh objects that have the same mesh, the same live modifiers, and show the same without these.

    Parameters
    ----------
    objects : iterable of bpy.types.Object
    apply_modifiers : bool
        Else only what the mesh itself has counts, and all modifiers are live.
    live_types : collection of str
        As of `live_modifiers`.

    Returns
    -------
    list of list of bpy.types.Object
        In the order given.
    """
    groups: dict[object, list[bpy.types.Object]] = {}
    for obj in objects:
        live = live_modifiers(obj, live_types) if apply_modifiers else list(obj.modifiers.keys())
        kept = [(name, settings_of_modifier(obj, obj.modifiers[name])) for name in live]
        bones = obj.parent.name if obj.parent is not None and obj.parent_type == "ARMATURE" else ""
        groups.setdefault((obj.data, repr(kept), bones), []).append(obj)
    if not apply_modifiers:
        return list(groups.values())
    return [part for group in groups.values() for part in _split(group, live_types)]


def _split(group: Sequence[bpy.types.Object], live_types: Collection[str]) -> list[list[bpy.types.Object]]:
    """Split objects by the meshes that Blender makes of them: what a setting depends on, only Blender knows."""
    live = {obj: live_modifiers(obj, live_types) for obj in group}
    applied = [obj for obj in group
               if any(modifier.show_viewport and modifier.name not in live[obj] for modifier in obj.modifiers)]
    if len(group) == 1 or not applied:
        return [list(group)]
    parts: dict[str, list[bpy.types.Object]] = {}
    with ExitStack() as stack:
        for obj in applied:
            stack.enter_context(switched_off(obj, live[obj]))
        depsgraph = bpy.context.evaluated_depsgraph_get()
        shown = [_shown(obj, depsgraph) if obj in applied else "as stored" for obj in group]
    known: dict[str, str] = {}
    for obj, digest in zip(group, shown, strict=True):
        if digest is not None:
            parts.setdefault(digest, []).append(obj)
            known.setdefault(modifier_settings(obj), digest)
    for obj, digest in zip(group, shown, strict=True):
        if digest is None:  # Blender makes nothing of it: what its modifiers say must do
            settings = modifier_settings(obj)
            parts.setdefault(known.get(settings, settings), []).append(obj)
    return list(parts.values())


def _shown(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> str | None:
    """Hash the mesh that Blender makes of an object; None if it makes none."""
    if not obj.evaluated_get(depsgraph).is_evaluated:
        return None
    with evaluated_mesh(obj, depsgraph) as mesh:
        return digest_of_layers(mesh)
