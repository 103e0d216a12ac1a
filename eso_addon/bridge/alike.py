# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects of one mesh can share what is made from it: those that show the same mesh, whatever it depends on."""

from collections.abc import Collection, Iterable, Sequence
from contextlib import ExitStack

import bpy

from .fingerprint import digest_of_layers, looks_outside, modifier_settings
from .modifiers import is_bent, live_modifiers, switched_off


def alike(objects: Iterable[bpy.types.Object], *, apply_modifiers: bool,
          live_types: Collection[str]) -> list[list[bpy.types.Object]]:
    """Group mesh objects that have the same mesh, the same modifiers, and show the same without the live ones.

    Parameters
    ----------
    objects : iterable of bpy.types.Object
    apply_modifiers : bool
        Else only the mesh itself is asked for, and what modifiers make of it does not matter.
    live_types : collection of str
        As of `live_modifiers`.

    Returns
    -------
    list of list of bpy.types.Object
        In the order given.
    """
    groups: dict[object, list[bpy.types.Object]] = {}
    for obj in objects:
        bender = obj.parent if is_bent(obj) else None
        names = tuple(obj.modifiers.keys())  # the live ones are kept by name
        groups.setdefault((obj.data, names, modifier_settings(obj, places=False), bender), []).append(obj)
    if not apply_modifiers:
        return list(groups.values())
    return [part for group in groups.values() for part in _split(group, live_types)]


def _split(group: Sequence[bpy.types.Object], live_types: Collection[str]) -> list[list[bpy.types.Object]]:
    """Split objects of the same settings by what Blender makes of them, if modifiers look at anything besides."""
    live = live_modifiers(group[0], live_types)
    applied = [mod for mod in group[0].modifiers if mod.show_viewport and mod.name not in live]
    if len(group) == 1 or not any(map(looks_outside, applied)):
        return [list(group)]
    parts: dict[str, list[bpy.types.Object]] = {}
    with ExitStack() as stack:
        for obj in group:
            stack.enter_context(switched_off(obj, live))
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for obj in group:
            evaluated = obj.evaluated_get(depsgraph)
            # Not a mesh of its own, for which Blender would evaluate each object once more.
            shown = digest_of_layers(evaluated.data) if evaluated.is_evaluated else modifier_settings(obj)
            parts.setdefault(shown, []).append(obj)
    return list(parts.values())
