# SPDX-License-Identifier: GPL-3.0-or-later
"""Which UV map and which colour of a mesh are active, and which are rendered."""

from collections.abc import Mapping
from typing import Any

import bpy


def read_active(mesh: bpy.types.Mesh) -> dict[str, str]:
    """Give the names of those that there are: "uv", "uv_render", "color", "color_render"."""
    names = {
        "uv": mesh.uv_layers.active.name if mesh.uv_layers.active else "",
        "uv_render": next((layer.name for layer in mesh.uv_layers if layer.active_render), ""),
        "color": mesh.attributes.active_color_name,
        "color_render": mesh.attributes.default_color_name,
    }
    return {which: name for which, name in names.items() if name}


def write_active(mesh: bpy.types.Mesh, names: Mapping[str, Any]) -> None:
    """Make those active and rendered that are named so, as far as the mesh has them."""
    uv, shown = (mesh.uv_layers.get(str(names.get(which, ""))) for which in ("uv", "uv_render"))
    if uv is not None:
        mesh.uv_layers.active = uv
    if shown is not None:
        shown.active_render = True
    color, rendered = (str(names.get(which, "")) for which in ("color", "color_render"))
    if color in mesh.attributes:
        mesh.attributes.active_color_name = color
    if rendered in mesh.attributes:
        mesh.attributes.default_color_name = rendered
