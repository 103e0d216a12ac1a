# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage for exporters: a scene of chosen objects under the names they are to have, and everything back afterwards."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager

import bpy


@contextmanager
def staged(title: str, names: Mapping[bpy.types.Object, str],
           parents: Mapping[bpy.types.Object, bpy.types.Object | None]) -> Iterator[list[bpy.types.Object]]:
    """Show only some objects to an exporter.

    Parameters
    ----------
    title : str
        Of the scene.
    names : mapping
        The objects, in order, and their names in the file.
    parents : mapping
        Parents that objects have in the file instead of their own; they stay where they stand.

    Yields
    ------
    list of bpy.types.Object
        All objects of the scene: those chosen, the ones they hang on, and their armatures. All are selected.
    """
    with ExitStack() as stack:
        for obj, parent in parents.items():
            stack.enter_context(_parented(obj, parent))
        everything = list(dict.fromkeys([*_needed_by(names), *names]))
        stack.enter_context(_named(names))
        scene = stack.enter_context(_scene_of(title, everything))
        layer = scene.view_layers[0]
        for obj in everything:
            stack.enter_context(_shown(obj))
        layer.update()
        for obj in everything:
            obj.select_set(True)
        layer.objects.active = next(iter(names), None)
        yield everything


def _needed_by(objects: Sequence[bpy.types.Object] | Mapping[bpy.types.Object, str]) -> list[bpy.types.Object]:
    """List parents and armatures, the highest first."""
    found: dict[bpy.types.Object, None] = {}

    def visit(obj: bpy.types.Object) -> None:
        if obj in found:
            return
        if obj.parent is not None:
            visit(obj.parent)
        for modifier in obj.modifiers:
            if modifier.type == "ARMATURE" and modifier.object is not None:
                visit(modifier.object)
        found[obj] = None

    for obj in objects:
        visit(obj)
    return [obj for obj in found if obj not in objects]


@contextmanager
def _parented(obj: bpy.types.Object, parent: bpy.types.Object | None) -> Iterator[None]:
    old = obj.parent, obj.parent_type, obj.parent_bone, obj.matrix_parent_inverse.copy(), obj.matrix_basis.copy()
    world = obj.matrix_world.copy()
    obj.parent = parent
    obj.parent_type = "OBJECT"
    obj.matrix_parent_inverse.identity()
    obj.matrix_basis = world if parent is None else parent.matrix_world.inverted_safe() @ world
    try:
        yield
    finally:
        obj.parent, obj.parent_type, obj.parent_bone, obj.matrix_parent_inverse, obj.matrix_basis = old


@contextmanager
def _named(names: Mapping[bpy.types.Object, str]) -> Iterator[None]:
    """Name objects; whatever else has such a name lets go of it for the time being."""
    wanted = set(names.values())
    others = [obj for obj in bpy.data.objects if obj.name in wanted and obj.library is None and obj not in names]
    before = {obj: obj.name for obj in [*names, *others]}
    try:
        for number, obj in enumerate(before):
            obj.name = f"eso_lod aside {number}"
        for obj, name in names.items():
            obj.name = name
        yield
    finally:
        for number, obj in enumerate(before):
            obj.name = f"eso_lod aside {number}"
        for obj, name in before.items():
            obj.name = name


@contextmanager
def _scene_of(title: str, objects: Sequence[bpy.types.Object]) -> Iterator[bpy.types.Scene]:
    """Show a scene of these objects in the window, with the time and the units of the one before."""
    before, window = bpy.context.scene, bpy.context.window
    scene = bpy.data.scenes.new(title)
    for name in ("frame_start", "frame_end", "frame_current"):
        setattr(scene, name, getattr(before, name))
    scene.render.fps, scene.render.fps_base = before.render.fps, before.render.fps_base
    scene.unit_settings.system = before.unit_settings.system
    scene.unit_settings.scale_length = before.unit_settings.scale_length
    for obj in objects:
        scene.collection.objects.link(obj)
    window.scene = scene
    try:
        yield scene
    finally:
        window.scene = before
        bpy.data.scenes.remove(scene)


@contextmanager
def _shown(obj: bpy.types.Object) -> Iterator[None]:
    hidden = obj.hide_viewport, obj.hide_render, obj.hide_select
    obj.hide_viewport = obj.hide_render = obj.hide_select = False
    try:
        yield
    finally:
        obj.hide_viewport, obj.hide_render, obj.hide_select = hidden
