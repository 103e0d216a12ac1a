# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The picture in which errors are judged, as Blender properties, for one result and for levels."""

from typing import Any

import bpy
from bpy.props import FloatProperty, IntProperty


class ScreenOptions:
    """How many pixels may be seen to be wrong, of which picture."""

    pixel_error: FloatProperty(
        name="Pixels", description="Largest error that may be seen, in pixels", default=1.0, min=0.01, soft_max=10.0
    )
    resolution: IntProperty(
        name="Resolution", description="Pixels along the wider side of the picture", default=1920, min=1, max=100_000
    )
    lens: FloatProperty(
        name="Lens", description="Focal length in millimetres, on a sensor 36 mm wide", default=50.0, min=1.0,
        soft_max=250.0
    )

    def draw_screen(self, layout: bpy.types.UILayout) -> None:
        """Draw the options."""
        for name in ("pixel_error", "resolution", "lens"):
            layout.prop(self, name)

    def screen_settings(self) -> dict[str, Any]:
        """Give the picture as plain data: the arguments of `Screen`."""
        return {"resolution": self.resolution, "lens": self.lens, "pixels": self.pixel_error}
