# SPDX-License-Identifier: GPL-3.0-or-later
"""The attributes of a Blender mesh as layers of the core: what is read of each, what it means, how it is written."""

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.attributes import Attribute
from .attributes import ATTRIBUTE_TYPES, read_attribute, write_attribute
from .selection import MARK

# Made anew by Blender, or written apart.
_APART = {"position", "custom_normal", ".edge_verts", ".corner_vert", ".corner_edge", MARK}
# Of the editors: what was selected or hidden there has no meaning on another mesh.
_EDITORS = (".select_", ".hide_", ".uv_select_", ".vs.", ".es.")
_LINES = {"uv_seam": "seam", ".uv_seam": "seam", "sharp_edge": "sharp", "crease_edge": "sharp",
          "bevel_weight_edge": "sharp", "freestyle_edge": "sharp"}
_BORDERS = {"material_index": "material", "sharp_face": "sharp"}
_KINDS = {"FLOAT": "value", "FLOAT2": "value", "FLOAT_VECTOR": "value", "FLOAT4": "value", "FLOAT4X4": "value",
          "FLOAT_COLOR": "color", "BYTE_COLOR": "color", "QUATERNION": "rotation"}


@dataclass(frozen=True, eq=False)
class Layer:
    """One attribute of a Blender mesh.

    Attributes
    ----------
    name, data_type, domain : str
        As Blender has them.
    kind : str
        As the core's `Attribute` has it.
    values : ndarray
        One row for each element of the domain.
    """

    name: str
    data_type: str
    domain: str
    kind: str
    values: NDArray


def read_layers(mesh: bpy.types.Mesh) -> tuple[Layer, ...]:
    """Read all attributes that a simplified version can carry."""
    layers = []
    for attribute in mesh.attributes:
        name, data_type, domain = attribute.name, attribute.data_type, attribute.domain
        if name in _APART or name.startswith(_EDITORS) or domain not in ("POINT", "EDGE", "CORNER", "FACE"):
            continue
        if data_type == "STRING":
            values = np.array([item.value for item in attribute.data], object)
        elif data_type in ATTRIBUTE_TYPES:
            read = read_attribute(mesh, name)
            assert read is not None
            values = read
        else:
            continue
        layers.append(Layer(name, data_type, domain, _kind(name, data_type, domain), values))
    return tuple(layers)


def _kind(name: str, data_type: str, domain: str) -> str:
    """Tell what an attribute means."""
    if domain == "EDGE":
        return _LINES.get(name, "label")
    if domain == "FACE":
        return _BORDERS.get(name, "label")
    if data_type == "FLOAT2" and domain == "CORNER":
        return "uv"
    return _KINDS.get(data_type, "label")


def unreadable(mesh: bpy.types.Mesh) -> list[str]:
    """Name the attributes of a type that is not known."""
    return [a.name for a in mesh.attributes if a.data_type not in ATTRIBUTE_TYPES and a.data_type != "STRING"]


def for_engine(layers: tuple[Layer, ...], triangle_corners: NDArray[np.int64],
               triangle_polygon: NDArray[np.int64]) -> dict[str, Attribute]:
    """Give the layers as the engine takes them: all but those of faces, which follow the map of faces.

    Parameters
    ----------
    layers : tuple of Layer
    triangle_corners : ndarray, (m, 3) int64
    triangle_polygon : ndarray, (m,) int64
    """
    attributes = {}
    for layer in layers:
        if layer.domain == "POINT":
            attributes[layer.name] = Attribute(layer.values, "vertex", layer.kind)
        elif layer.domain == "CORNER":
            attributes[layer.name] = Attribute(at_corners(layer.values, triangle_corners), "corner", layer.kind)
        elif layer.domain == "EDGE":
            attributes[layer.name] = Attribute(layer.values, "edge", layer.kind)
        elif layer.kind != "label":  # borders of these are lines
            attributes[layer.name] = Attribute(layer.values[triangle_polygon], "face", layer.kind)
    return attributes


def at_corners(values: NDArray, triangle_corners: NDArray[np.int64]) -> NDArray:
    """Give values of a mesh's corners, (l, ...), at the corners of its triangles, (m, 3, ...)."""
    if len(values) == triangle_corners.size:  # the mesh has nothing but triangles
        return values.reshape(*triangle_corners.shape, *values.shape[1:])
    return values[triangle_corners]


def write_layer(mesh: bpy.types.Mesh, layer: Layer, values: NDArray) -> None:
    """Write a layer's values on the elements of another mesh, active and rendered as the source's is."""
    if layer.data_type == "STRING":
        attribute = mesh.attributes.new(layer.name, "STRING", layer.domain)
        for item, value in zip(attribute.data, values, strict=True):
            item.value = value
    else:
        write_attribute(mesh, layer.name, layer.data_type, layer.domain, values)
