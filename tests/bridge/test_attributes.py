# SPDX-License-Identifier: GPL-3.0-or-later
import bpy
import numpy as np
import pytest

from eso_addon.bridge.attributes import ATTRIBUTE_TYPES, read_attribute, write_attribute
from tests.bridge.blender_scenes import add_cube


def types_of(mesh: bpy.types.Mesh) -> set[str]:
    return set(mesh.attributes.bl_rna.functions["new"].parameters["type"].enum_items.keys())


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE"])
@pytest.mark.parametrize("data_type", ATTRIBUTE_TYPES)
def test_every_type_comes_back_as_written(data_type: str, domain: str) -> None:
    mesh = add_cube().data
    if data_type not in types_of(mesh):
        pytest.skip(f"this Blender has no {data_type}")
    kind = ATTRIBUTE_TYPES[data_type]
    count = {"POINT": 8, "CORNER": 24, "FACE": 6}[domain]
    shape = (count,) if kind.width == 1 else (count, kind.width)
    values = np.random.default_rng(0).integers(0, 2, shape).astype(kind.dtype)
    write_attribute(mesh, "values", data_type, domain, values)
    read = read_attribute(mesh, "values")
    assert read is not None
    assert read.dtype == values.dtype
    assert np.array_equal(read, values)


def test_the_table_knows_every_type_of_this_blender_but_text() -> None:
    assert types_of(add_cube().data) - {"STRING"} <= set(ATTRIBUTE_TYPES)


def test_an_attribute_that_is_not_there_is_none() -> None:
    assert read_attribute(add_cube().data, "nothing") is None
