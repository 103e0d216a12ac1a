# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells whether a mesh object was edited: a hash of all that its levels are made from."""

from hashlib import blake2b

import bpy

# Marks of the editor, not of the shape.
_EDITORS_OWN = (".select_vert", ".select_edge", ".select_poly", ".hide_vert", ".hide_edge", ".hide_poly", ".vs.",
                ".es.", ".pn.")
_NOT_SETTINGS = {"is_active", "show_expanded", "show_in_editmode", "show_on_cage", "execution_time", "rna_type",
                 "persistent_uid", "use_pin_to_last", "name"}


def fingerprint(obj: bpy.types.Object) -> str:
    """Hash an object's mesh as it is stored, its shape keys, and its modifiers' settings; not its place nor its pose.

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

    from .attributes import ATTRIBUTE_TYPES, read_attribute

    digest = blake2b(digest_size=16)
    mesh = obj.data
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


def modifier_settings(obj: bpy.types.Object) -> str:
    """List the settings of an object's modifiers as text."""
    return repr([(modifier.type, _settings(modifier)) for modifier in obj.modifiers])


def _settings(modifier: bpy.types.Modifier) -> list[tuple[str, str]]:
    found = []
    for prop in modifier.bl_rna.properties:
        if prop.identifier in _NOT_SETTINGS or prop.type == "COLLECTION":
            continue
        value = getattr(modifier, prop.identifier)
        if prop.type == "POINTER":
            value = value.name if isinstance(value, bpy.types.ID) else ""
        elif getattr(prop, "is_array", False):
            value = tuple(map(tuple, value)) if len(value) and hasattr(value[0], "__len__") else tuple(value)
        found.append((prop.identifier, str(value)))
    return found
