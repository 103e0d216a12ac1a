# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""What the operators have in common that show something of the active mesh."""

from typing import Any

import bpy
from bpy.props import BoolProperty

from ..core.errors import MeshError
from ..jobs.modal import EngineOperator
from .polls import poll_with, why_not_simplify


class ActiveMeshOperator(EngineOperator):
    """Reads the active mesh, which is left as it is."""

    apply_modifiers: BoolProperty(
        name="Apply Modifiers", description="Look at the mesh as modifiers and shape keys show it", default=True
    )

    _object: bpy.types.Object
    _source: Any  # MeshArrays

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need an active mesh object."""
        return poll_with(cls, why_not_simplify(context))

    def read(self, context: bpy.types.Context) -> None:
        """Read the active mesh.

        Raises
        ------
        MeshError
            It has no faces, or cannot be read.
        """
        from ..bridge.read_mesh import read_mesh

        self._object = context.active_object
        self._source = read_mesh(self._object, apply_modifiers=self.apply_modifiers)
        if not len(self._source.triangles):
            raise MeshError(f"'{self._object.name}' has no faces: there is nothing to show")
