# SPDX-License-Identifier: GPL-3.0-or-later
"""Which faces are selected in Edit Mode, and which of them modifiers make of those."""

from collections.abc import Iterator
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError
from .attributes import read_attribute

# Modifiers that divide faces drop Blender's own marks of a selection, and hand on what has a plain name.
MARK = "eso_lod selected"


def selected_faces(mesh: bpy.types.Mesh) -> NDArray[np.bool_]:
    """Tell which faces of a stored mesh are selected, (polygons,)."""
    values = read_attribute(mesh, ".select_poly")
    return np.zeros(len(mesh.polygons), np.bool_) if values is None else values


def is_part_selected(mesh: bpy.types.Mesh) -> bool:
    """Tell whether some faces of a stored mesh are selected, and some are not."""
    selected = selected_faces(mesh)
    return bool(selected.any() and not selected.all())


@contextmanager
def marked_selection(obj: bpy.types.Object) -> Iterator[None]:
    """Mark the selected faces of an object in Edit Mode by an attribute."""
    edited = bmesh.from_edit_mesh(obj.data)
    layers = edited.faces.layers.int  # before 4.3 there are no booleans
    layer = layers.get(MARK) or layers.new(MARK)
    try:
        for face in edited.faces:  # in Edit Mode Blender has no quicker way
            face[layer] = face.select
        _store(obj)
        yield
    finally:
        edited.faces.layers.int.remove(edited.faces.layers.int[MARK])
        _store(obj)


def _store(obj: bpy.types.Object) -> None:
    """Have what is edited evaluated."""
    obj.update_from_editmode()
    bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)


def marked_faces(mesh: bpy.types.Mesh) -> NDArray[np.bool_]:
    """Tell which faces of an evaluated mesh come from marked ones, (polygons,).

    Raises
    ------
    MeshError
        The modifiers do not tell, or leave nothing of them.
    """
    mark = mesh.attributes.get(MARK)
    if mark is None or mark.domain != "FACE" or mark.data_type != "INT":
        raise MeshError("modifiers do not tell which faces come from the selected ones: "
                        "apply them first, or turn Only Selected off")
    marks = read_attribute(mesh, MARK)
    if marks is None or not marks.any():
        raise MeshError("modifiers leave nothing of the selected faces: select others, or turn Only Selected off")
    return marks != 0
