# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of Blender's attribute types; named arrays on vertices, corners or faces go in and out through it."""

from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import DTypeLike, NDArray


class AttributeType(NamedTuple):
    """How Blender stores one kind of attribute."""

    dtype: DTypeLike
    width: int
    field: str  # what foreach_get and foreach_set call the value


ATTRIBUTE_TYPES: dict[str, AttributeType] = {
    "FLOAT": AttributeType(np.float32, 1, "value"),
    "INT": AttributeType(np.int32, 1, "value"),
    "INT8": AttributeType(np.int8, 1, "value"),
    "BOOLEAN": AttributeType(np.bool_, 1, "value"),
    "FLOAT_VECTOR": AttributeType(np.float32, 3, "vector"),
    "FLOAT2": AttributeType(np.float32, 2, "vector"),
    "FLOAT_COLOR": AttributeType(np.float32, 4, "color"),
    "BYTE_COLOR": AttributeType(np.float32, 4, "color"),
    "INT16_2D": AttributeType(np.int16, 2, "value"),
    "INT32_2D": AttributeType(np.int32, 2, "value"),
    "FLOAT4": AttributeType(np.float32, 4, "vector"),
    "QUATERNION": AttributeType(np.float32, 4, "value"),
    "FLOAT4X4": AttributeType(np.float32, 16, "value"),
}


def read_attribute(mesh: bpy.types.Mesh, name: str) -> NDArray | None:
    """Read a named attribute.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    name : str

    Returns
    -------
    values : ndarray, (n,) or (n, width), dtype of the table; None if the mesh has no such attribute
    """
    attribute = mesh.attributes.get(name)
    if attribute is None:
        return None
    kind = ATTRIBUTE_TYPES[attribute.data_type]
    values = np.zeros(len(attribute.data) * kind.width, kind.dtype)
    attribute.data.foreach_get(kind.field, values)
    return values if kind.width == 1 else values.reshape(-1, kind.width)


def write_attribute(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str, values: NDArray) -> None:
    """Write a named attribute, which is made if it is not there.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    name : str
    data_type : str
        A key of `ATTRIBUTE_TYPES`.
    domain : str
        ``"POINT"``, ``"EDGE"``, ``"CORNER"`` or ``"FACE"``.
    values : ndarray
        One row for each element of the domain.
    """
    kind = ATTRIBUTE_TYPES[data_type]
    attribute = mesh.attributes.get(name) or mesh.attributes.new(name, data_type, domain)
    attribute.data.foreach_set(kind.field, np.ascontiguousarray(values, kind.dtype).ravel())
