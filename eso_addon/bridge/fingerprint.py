# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells whether a mesh object was edited: a hash of all that its levels are made from."""

from contextlib import suppress
from hashlib import blake2b
from typing import Any

import bpy
from mathutils import Matrix

# Marks of the editor, not of the shape.
_EDITORS_OWN = (".select_vert", ".select_edge", ".select_poly", ".hide_vert", ".hide_edge", ".hide_poly", ".vs.",
                ".es.", ".pn.")
_NOT_SETTINGS = {"is_active", "show_expanded", "show_in_editmode", "show_on_cage", "execution_time", "rna_type",
                 "persistent_uid", "use_pin_to_last", "name", "select", "show_group_selector", "show_manage_panel",
                 "bakes", "panels", "node_warnings", "bake_directory", "bake_target", "is_override_data",
                 "particle_system", "point_cache"}
# What these have below their settings changes with every frame, and is never in a level's mesh.
_SHALLOW = {"CLOTH", "SOFT_BODY", "COLLISION", "DYNAMIC_PAINT", "FLUID", "PARTICLE_SYSTEM"}
_DEEPEST = 5  # of settings within settings
_DIGITS = 5  # of a place beside another: float32 has two more


def fingerprint(obj: bpy.types.Object) -> str:
    """Hash an object's mesh as it is stored, its shape keys, and its modifiers' settings; not its place nor its pose.

    Where other objects that modifiers look at stand beside it counts, but for what poses it.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object in Object Mode; in Edit Mode the mesh is the one before.

    Returns
    -------
    str
        32 hexadecimal digits for the mesh, a hyphen, and 16 for the modifiers.
    """
    modifiers = blake2b(modifier_settings(obj).encode(), digest_size=8).hexdigest()
    return f"{_mesh_digest(obj)}-{modifiers}"


def has_same_modifiers(obj: bpy.types.Object, earlier: str) -> bool:
    """Tell whether an object's modifiers are as they were when it had this fingerprint; the mesh is not looked at."""
    return earlier.endswith(blake2b(modifier_settings(obj).encode(), digest_size=8).hexdigest())


def _mesh_digest(obj: bpy.types.Object) -> str:
    import numpy as np

    mesh = obj.data
    digest = blake2b(digest_size=16)
    _add_layers(digest, mesh)
    digest.update(repr([group.name for group in obj.vertex_groups]).encode())
    if len(obj.vertex_groups):
        weights = [(vertex.index, element.group, element.weight) for vertex in mesh.vertices
                   for element in vertex.groups]
        digest.update(np.array(weights, np.float64).tobytes())
    if mesh.shape_keys is not None:
        for key in mesh.shape_keys.key_blocks:
            points = np.zeros(len(key.data) * 3, np.float32)
            key.points.foreach_get("co", points)
            digest.update(f"{key.name}\0{key.relative_key.name}".encode())
            digest.update(points.tobytes())
    return digest.hexdigest()


def digest_of_layers(mesh: bpy.types.Mesh) -> str:
    """Hash the elements of a mesh and all their attributes."""
    digest = blake2b(digest_size=16)
    _add_layers(digest, mesh)
    return digest.hexdigest()


def _add_layers(digest: blake2b, mesh: bpy.types.Mesh) -> None:
    import numpy as np

    from .attributes import ATTRIBUTE_TYPES, read_attribute

    digest.update(repr((len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons))).encode())
    starts = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    digest.update(starts.tobytes())
    for attribute in sorted(mesh.attributes, key=lambda attribute: attribute.name):
        if attribute.name.startswith(_EDITORS_OWN):
            continue
        digest.update(f"{attribute.name}\0{attribute.domain}\0{attribute.data_type}".encode())
        if attribute.data_type in ATTRIBUTE_TYPES:
            digest.update(np.asarray(read_attribute(mesh, attribute.name)).tobytes())


def modifier_settings(obj: bpy.types.Object, *, places: bool = True) -> str:
    """List the settings of an object's modifiers as text, and where what they look at stands beside the object."""
    beside = obj.matrix_world.inverted_safe() if places else None
    return repr([(mod.type, _of_modifier(mod, None if mod.type == "ARMATURE" else beside)) for mod in obj.modifiers])


def _of_modifier(modifier: bpy.types.Modifier, beside: Matrix | None) -> list[tuple[str, Any]]:
    found = _settings(modifier, beside, 0 if modifier.type in _SHALLOW else _DEEPEST)
    if modifier.type == "NODES":
        with suppress(TypeError):  # since Blender 5.2 inputs are settings like others
            found += [(key, _told(modifier[key], beside, _DEEPEST)) for key in modifier.keys()]  # noqa: SIM118
    return found


def looks_outside(modifier: bpy.types.Modifier) -> bool:
    """Tell whether what a modifier does may depend on more than its settings: on other objects, or on node groups."""
    values = [getattr(modifier, prop.identifier) for prop in modifier.bl_rna.properties
              if prop.type in {"POINTER", "COLLECTION"} and prop.identifier != "rna_type"]
    return any(isinstance(value, bpy.types.ID) or (isinstance(value, bpy.types.bpy_prop_collection) and len(value))
               for value in values)


def _settings(thing: bpy.types.bpy_struct, beside: Matrix | None, depth: int) -> list[tuple[str, Any]]:
    found = []
    for prop in thing.bl_rna.properties:
        if prop.identifier in _NOT_SETTINGS or prop.identifier.startswith("open_"):
            continue
        if prop.type == "COLLECTION" and not depth:
            continue
        with suppress(AttributeError):  # sockets that Blender has not made yet
            found.append((prop.identifier, _told(getattr(thing, prop.identifier), beside, depth)))
    return found


def _told(value: Any, beside: Matrix | None, depth: int) -> Any:  # noqa: ANN401 - whatever a setting holds
    """Give a setting as what has a stable text: things of the file by name, others by what is in them."""
    if isinstance(value, bpy.types.ID):
        return value.name, _places(value, beside)
    if isinstance(value, bpy.types.bpy_struct):
        return _settings(value, beside, depth - 1) if depth > 0 else ""
    if isinstance(value, set):
        return sorted(value)  # whose order is another one in each session
    if isinstance(value, str) or not hasattr(value, "__len__"):
        return str(value)
    return [_told(part, beside, depth) for part in value]


def _places(thing: bpy.types.ID, beside: Matrix | None) -> list[float]:
    """Give where an object, or each of a collection, stands beside another, so that noise makes no difference."""
    if beside is None:
        return []
    objects = [thing] if isinstance(thing, bpy.types.Object) else getattr(thing, "all_objects", ())
    return [round(value, _DIGITS) + 0.0 for obj in objects for row in beside @ obj.matrix_world for value in row]
