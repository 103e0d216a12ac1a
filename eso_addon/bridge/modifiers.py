# SPDX-License-Identifier: GPL-3.0-or-later
"""Modifiers that belong after decimation: they stay live on the levels, the others go into the mesh."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager

import bpy

_ANYWHERE = {"ARMATURE"}  # what is simplified is the mesh at rest, whatever comes before or after
# Never put into a mesh: they go on on the new one.
_SIMULATED = {"CLOTH", "SOFT_BODY", "COLLISION", "DYNAMIC_PAINT", "FLUID", "PARTICLE_SYSTEM", "SURFACE"}


def live_modifiers(obj: bpy.types.Object, types: Collection[str]) -> list[str]:
    """Name the modifiers that stay live.

    Parameters
    ----------
    obj : bpy.types.Object
    types : collection of str
        Kinds of modifiers, such as "ARMATURE" or "MIRROR". A Mirror or Subdivision Surface stays live only if nothing
        but such modifiers comes after it: what comes after works on its result. Simulations always stay.

    Returns
    -------
    list of str
    """
    names: list[str] = []
    is_tail = True
    for modifier in reversed(obj.modifiers):
        is_tail = is_tail and modifier.type in types
        stays = modifier.type in types and (is_tail or modifier.type in _ANYWHERE)
        if stays or modifier.type in _SIMULATED:
            names.append(modifier.name)
    return names[::-1]


@contextmanager
def switched_off(obj: bpy.types.Object, names: Collection[str]) -> Iterator[None]:
    """Evaluate an object without some of its modifiers, and as no parent bends it: that stays live too."""
    shown = [modifier for modifier in obj.modifiers if modifier.name in names and modifier.show_viewport]
    how = obj.parent_type
    bent = is_bent(obj) and len(obj.modifiers) > 0
    try:
        for modifier in shown:
            modifier.show_viewport = False
        if bent:
            _set_parent_type(obj, "OBJECT")
        yield
    finally:
        for modifier in shown:
            modifier.show_viewport = True
        if bent:
            _set_parent_type(obj, how)


def is_bent(obj: bpy.types.Object) -> bool:
    """Tell whether an object's parent moves its vertices, as a modifier would."""
    return obj.parent is not None and obj.parent_type in {"ARMATURE", "LATTICE"}


def _set_parent_type(obj: bpy.types.Object, kind: str) -> None:
    inverse = obj.matrix_parent_inverse.copy()  # which Blender clears
    obj.parent_type = kind
    obj.matrix_parent_inverse = inverse


def is_bound(modifier: bpy.types.Modifier) -> bool:
    """Tell whether a modifier holds data for each vertex of the mesh that it was bound to."""
    return bool(getattr(modifier, "is_bound", False) or getattr(modifier, "is_bind", False))


def keep_modifiers(obj: bpy.types.Object, names: Collection[str]) -> None:
    """Remove all modifiers but some."""
    for modifier in [modifier for modifier in obj.modifiers if modifier.name not in names]:
        obj.modifiers.remove(modifier)
