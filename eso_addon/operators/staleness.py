# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks levels as stale when their source is edited, and takes the mark away when the edit is undone."""

import bpy
from bpy.app.handlers import persistent

from ..bridge import level_info
from ..bridge.fingerprint import has_same_modifiers


@persistent
def mark_stale(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Look at the levels of every mesh that was edited; in Edit Mode that waits until it is left."""
    if scene.is_evaluated:
        return
    edited = {update.id.original for update in depsgraph.updates if update.is_updated_geometry}
    meshes = {thing for thing in edited if isinstance(thing, bpy.types.Mesh)}
    objects = {thing for thing in edited if isinstance(thing, bpy.types.Object) and thing.type == "MESH"}
    if meshes or objects:
        levels = [obj for obj in bpy.data.objects if level_info.is_level(obj)]
        for source in {level_info.find_source(level) for level in levels}:
            if source is None:
                continue
            if source.mode == "OBJECT" and (source.data in meshes or (source in objects and _is_remodelled(source))):
                refresh(level_info.levels_of(source))


def _is_remodelled(source: bpy.types.Object) -> bool:
    """Tell whether modifiers were edited: an armature moves the mesh at every frame, and makes nothing stale."""
    return not all(has_same_modifiers(source, str(level.get(level_info.HASH, "")))
                   for level in level_info.levels_of(source))


def refresh(levels: list[bpy.types.Object]) -> None:
    """Mark those levels that are stale, and only those."""
    stale = set(level_info.stale_ones(levels))
    for level in levels:
        if bool(level.get(level_info.STALE, False)) != (level in stale):
            level[level_info.STALE] = level in stale


def register() -> None:
    """Listen for edits."""
    bpy.app.handlers.depsgraph_update_post.append(mark_stale)


def unregister() -> None:
    """Listen no more."""
    if mark_stale in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(mark_stale)
