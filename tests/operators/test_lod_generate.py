# SPDX-License-Identifier: GPL-3.0-or-later
import bpy
import numpy as np
import pytest

from eso_addon.bridge.read_mesh import read_mesh
from eso_addon.core.simplify import lod_chain
from tests.bridge.blender_scenes import activate, add_sphere, arrays

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate


@pytest.mark.parametrize(
    ("options", "targets"),
    [
        ({"ratios": "0.5, 0.25, 0.125"}, {"ratios": [0.5, 0.25, 0.125]}),
        ({"levels_by": "count", "faces_targets": "100; 400"}, {"faces_targets": [400, 100]}),
        ({"levels_by": "error", "max_errors": "0.05 0.01"}, {"max_errors": [0.01, 0.05]}),
    ],
)
def test_operator_and_api_give_equal_arrays(options: dict, targets: dict) -> None:
    obj = add_sphere()
    assert generate(**options) == {"FINISHED"}
    levels = lod_chain(*arrays(obj), **targets, **read_mesh(obj, carry=True).carried)
    names = [f"Ball_LOD{number}" for number in range(len(levels))]
    assert [o.name for o in bpy.data.collections["Ball_LODs"].objects] == names
    for name, level in zip(names, levels, strict=True):
        level_object = bpy.data.objects[name]
        vertices, triangles = arrays(level_object)
        assert np.array_equal(vertices, level.vertices.astype(np.float32))
        assert np.array_equal(triangles, level.faces)
        assert level_object["eso_source"] == "Ball"
        assert level_object["eso_triangles"] == len(level.faces)
        assert level_object["eso_ratio"] == len(level.faces) / 1280
        assert level_object["eso_error"] == level.error
        assert not level_object.data.validate()


def test_the_source_is_untouched_and_the_levels_are_selected() -> None:
    obj = add_sphere()
    before = arrays(obj)
    generate(ratios="0.5, 0.1", collection="Game")
    assert all(np.array_equal(a, b) for a, b in zip(before, arrays(obj), strict=True))
    assert {o.name for o in bpy.context.selected_objects} == {"Ball_LOD0", "Ball_LOD1"}
    assert bpy.context.object.name == "Ball_LOD0"
    assert len(bpy.data.collections["Game"].objects) == 2


def test_running_again_replaces_the_levels_or_keeps_them() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25, 0.1")
    activate(obj)
    generate(ratios="0.4, 0.2")
    assert sorted(o.name for o in bpy.data.objects) == ["Ball", "Ball_LOD0", "Ball_LOD1"]
    assert len(bpy.data.meshes) == 3
    activate(obj)
    generate(ratios="0.3", replace=False)
    assert len(bpy.data.objects) == 4


@pytest.mark.parametrize("text", ["", "half", "0.5, ,x", "0.5 0.25 -"])
def test_a_list_that_cannot_be_read_is_refused(text: str) -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="write numbers with commas between"):
        generate(ratios=text)


@pytest.mark.parametrize("text", ["0.5, 0", "1.5", "-0.1", "nan"])
def test_ratios_out_of_range_are_refused(text: str) -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="[Rr]atio"):
        generate(ratios=text)
    assert len(bpy.data.objects) == 1
    assert "Ball_LODs" not in bpy.data.collections


def test_counts_are_whole_numbers() -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="8000, 2000, 500"):
        generate(levels_by="count", faces_targets="0.5")


def test_edit_mode_is_left() -> None:
    add_sphere()
    bpy.ops.object.mode_set(mode="EDIT")
    generate(ratios="0.5")
    assert bpy.context.mode == "OBJECT"
    assert bpy.context.object.name == "Ball_LOD0"


def test_the_report_has_every_level() -> None:
    add_sphere()
    generate(ratios="0.5, 0.25")
    lines = bpy.context.window_manager.eso_last_run.lines.split("\n")
    assert lines[0] == "1,280 triangles"
    assert [line.split(" (")[0] for line in lines[1:3]] == ["LOD0 640", "LOD1 320"]


def test_no_active_object() -> None:
    with pytest.raises(RuntimeError, match="No active object"):
        generate()
