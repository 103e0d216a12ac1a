# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The operator that measures how far the active mesh deviates from its original."""

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ..jobs.modal import EngineOperator
from ..jobs.worker import Steps
from ..settings.preferences import preferences
from .polls import measured_pair, poll_with, why_not_measure
from .reports import tell

if TYPE_CHECKING:
    from ..bridge.read_mesh import MeshArrays
    from ..core.deviation import Deviation

_SPACES = (
    ("local", "Local", "Compare the shapes, wherever the objects stand"),
    ("world", "World", "Compare the surfaces where they are in the scene"),
)


class OBJECT_OT_eso_measure(EngineOperator, bpy.types.Operator):
    """Measure how far the active mesh deviates from the other selected mesh, or from the one it was made from"""

    bl_idname = "object.eso_measure"
    bl_label = "ESO Measure"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    space: EnumProperty(name="Space", items=_SPACES, default="local")
    apply_modifiers: BoolProperty(
        name="Apply Modifiers", description="Measure the meshes as modifiers and shape keys show them", default=True
    )
    samples: IntProperty(
        name="Samples", description="Points on each surface whose distance is measured", default=100_000, min=1
    )

    _title: str
    _second: dict[str, float]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Need two meshes."""
        return poll_with(cls, why_not_measure(context))

    def prepare(self, context: bpy.types.Context) -> "Steps[Deviation]":
        """Read both meshes."""
        from ..jobs import second_opinion

        original, simplified = measured_pair(context)
        self._title = f"{simplified.name} against {original.name}"
        one, other = self._read(original), self._read(simplified)
        arrays = one.vertices, one.triangles, other.vertices, other.triangles
        return self._both(arrays, ask=preferences().use_pymeshlab and second_opinion.is_there())

    def _both(self, arrays: tuple[Any, Any, Any, Any], *, ask: bool) -> "Generator[float, None, Deviation]":
        """Measure, and let pymeshlab measure too where the preferences want it."""
        from ..core.deviation import measure_steps
        from ..jobs import second_opinion

        self._second = {}
        result = yield from measure_steps(*arrays, samples=self.samples)
        if ask:
            self._second = yield from second_opinion.second_opinion_steps(*arrays, self.samples)
        return result

    def finish(self, context: bpy.types.Context, result: "Deviation") -> None:
        """Report the figures; nothing is written."""
        both = result.symmetric
        lines = [
            f"max {both.maximum:.3g} ({both.maximum / result.diagonal:.2%} of the diagonal)",
            f"mean {both.mean:.3g}",
            f"RMS {both.rms:.3g}",
            f"normals {both.normal:.1f}°",
            f"original to simplified {result.forward.maximum:.3g}",
            f"simplified to original {result.backward.maximum:.3g}",
            *(f"pymeshlab: {name} {value:.3g}" for name, value in self._second.items()),
            f"{self.seconds:.2f} s",
        ]
        tell(self, context, self._title, lines)

    def _read(self, obj: bpy.types.Object) -> "MeshArrays":
        import numpy as np

        from ..bridge.read_mesh import read_mesh

        world = np.array(obj.matrix_world, np.float64) if self.space == "world" else None
        return read_mesh(obj, apply_modifiers=self.apply_modifiers, transform=world)


OPERATOR = OBJECT_OT_eso_measure
