# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object made from another takes over, when it is made and when it is made again: everything but its mesh,
what is in that mesh already, and our marks. Only this file knows what that is.
"""

from collections.abc import Collection
from contextlib import AbstractContextManager, suppress

import bpy

from .modifiers import keep_modifiers

_MARK = "eso_"
_MODIFIERS = "eso_modifiers"  # of a level: names of the modifiers that it has from its source; others are the user's
# What an object keeps when it is made again: its identity, how it is shown, what belongs to its mesh, and
# other words for its transform.
_OWN = {
    "name", "data", "use_fake_user", "use_extra_user", "is_runtime_data", "tag", "asset_data",
    "hide_viewport", "hide_select", "hide_render", "instance_collection",
    "active_material", "active_material_index",
    "active_shape_key_index", "show_only_shape_key", "use_shape_key_edit_mode",
    "dimensions", "matrix_world", "matrix_local", "matrix_basis",
}  # fmt: skip


def copied(source: bpy.types.Object, data: bpy.types.Mesh | None, *, modifiers_applied: bool,
           live: Collection[str] = ()) -> bpy.types.Object:
    """Copy an object as what is made from it: local, shown, and without marks of what the source was made from.

    Parameters
    ----------
    source : bpy.types.Object
    data : bpy.types.Mesh or None
        What it shows; None for an empty.
    modifiers_applied : bool
        The mesh has the modifiers in it already, so that the copy goes without.
    live : collection of str
        Names of modifiers that are not in the mesh, and stay.

    Returns
    -------
    bpy.types.Object
        In no collection yet.
    """
    obj = source.copy()
    if obj.override_library is not None:  # else a reload would give the library's mesh back
        obj = obj.make_local(clear_liboverride=True)
    for prop in obj.bl_rna.properties:
        if prop.is_runtime and prop.identifier.startswith(_MARK):
            obj.property_unset(prop.identifier)
    for key in [key for key in obj.keys() if key.startswith(_MARK)]:  # noqa: SIM118 - an ID is no dictionary
        del obj[key]
    if data is not None:
        obj.data = data
    if modifiers_applied:
        keep_modifiers(obj, live)
    obj.hide_viewport = obj.hide_select = False
    return obj


def note_modifiers(obj: bpy.types.Object) -> None:
    """Remember the modifiers that a new level has of its source, so that later those are known that the user added."""
    obj[_MODIFIERS] = "\n".join(modifier.name for modifier in obj.modifiers)


def follow(obj: bpy.types.Object, source: bpy.types.Object, *, modifiers_applied: bool,
           live: Collection[str] = ()) -> None:
    """Have an object made earlier be what `copied` would give now, in place.

    Its mesh, name, collections, whether it is hidden, and modifiers and custom properties that the user added stay.

    Parameters
    ----------
    obj, source : bpy.types.Object
    modifiers_applied, live
        As of `copied`.
    """
    twin = copied(source, None, modifiers_applied=modifiers_applied, live=live)
    try:
        obj.rotation_mode = twin.rotation_mode  # first: setting it converts the rotation that is there
        for prop in twin.bl_rna.properties:  # in an order that sets the parent before its inverse
            name = prop.identifier
            if not (prop.is_runtime or name in _OWN or obj.is_property_readonly(name)):
                setattr(obj, name, getattr(twin, name))
        for key in twin.keys():  # noqa: SIM118 - an ID is no dictionary
            if key not in twin.bl_rna.properties:
                obj[key] = twin[key]
        obj.constraints.clear()
        for constraint in twin.constraints:
            obj.constraints.copy(constraint)
        _take_modifiers(obj, twin, source)
        obj.animation_data_clear()
        if twin.animation_data is not None:
            with _from(twin, obj):
                bpy.ops.object.make_links_data(type="ANIMATION")
    finally:
        bpy.data.objects.remove(twin)


def follow_modifiers(obj: bpy.types.Object, source: bpy.types.Object, *, modifiers_applied: bool,
                     live: Collection[str] = ()) -> None:
    """Have an object made earlier take over its source's modifiers as they are now, and nothing else; see `follow`."""
    twin = copied(source, None, modifiers_applied=modifiers_applied, live=live)
    try:
        _take_modifiers(obj, twin, source)
    finally:
        bpy.data.objects.remove(twin)


def _take_modifiers(obj: bpy.types.Object, twin: bpy.types.Object, source: bpy.types.Object) -> None:
    """Put the twin's modifiers in the place of those that the object had from the source; the user's come after."""
    noted = str(obj[_MODIFIERS]).split("\n") if _MODIFIERS in obj else [modifier.name for modifier in source.modifiers]
    keep_modifiers(obj, [modifier.name for modifier in obj.modifiers if modifier.name not in noted])
    taken = []
    for place, modifier in enumerate(twin.modifiers):
        before = set(obj.modifiers.keys())
        _copy_modifier(obj, twin, modifier)
        taken += [name for name in obj.modifiers.keys() if name not in before]  # noqa: SIM118 - no dictionary
        with suppress(RuntimeError):  # what needs the original mesh stays in front
            obj.modifiers.move(obj.modifiers.find(taken[-1]), place)
    obj[_MODIFIERS] = "\n".join(taken)


def _copy_modifier(obj: bpy.types.Object, twin: bpy.types.Object, modifier: bpy.types.Modifier) -> None:
    try:
        with _from(twin, obj):
            bpy.ops.object.modifier_copy_to_selected(modifier=modifier.name)
        return
    except RuntimeError:
        pass  # it refuses hooks and collisions
    new = obj.modifiers.new(modifier.name, modifier.type)
    for prop in modifier.bl_rna.properties:
        if not prop.is_readonly and prop.identifier != "name":
            setattr(new, prop.identifier, getattr(modifier, prop.identifier))


def _from(twin: bpy.types.Object, obj: bpy.types.Object) -> AbstractContextManager[None]:
    """Have Blender's operators copy from one object to another, wherever these are."""
    both = [twin, obj]
    return bpy.context.temp_override(object=twin, active_object=twin, selected_objects=both,
                                     selected_editable_objects=both)
