# SPDX-License-Identifier: GPL-3.0-or-later
from functools import partial

import bpy
import pytest

from eso_addon.core.deviation import measure
from eso_addon.operators.measure import OBJECT_OT_eso_measure
from tests.bridge.blender_scenes import activate, add_cube, add_sphere, arrays

pytestmark = pytest.mark.usefixtures("addon")
measure_active = partial(bpy.ops.object.eso_measure, samples=2000)


def last_lines() -> list[str]:
    return bpy.context.window_manager.eso_last_run.lines.split("\n")


def test_operator_and_api_give_equal_figures() -> None:
    fine, coarse = add_sphere("Fine", 4), add_sphere("Coarse", 2)
    activate(coarse, fine)
    assert measure_active() == {"FINISHED"}
    figures = measure(*arrays(fine), *arrays(coarse), samples=2000)
    assert bpy.context.window_manager.eso_last_run.title == "Coarse against Fine"
    lines = last_lines()
    assert lines[0].startswith(f"max {figures.symmetric.maximum:.3g} ")
    assert lines[1] == f"mean {figures.symmetric.mean:.3g}"
    assert f"original to simplified {figures.forward.maximum:.3g}" in lines
    assert f"simplified to original {figures.backward.maximum:.3g}" in lines


def test_a_result_is_measured_against_its_source() -> None:
    add_sphere()
    bpy.ops.object.eso_simplify(ratio=0.25)
    measure_active()
    assert bpy.context.window_manager.eso_last_run.title == "Ball_ESO against Ball"


def test_where_the_objects_stand_matters_only_in_world_space() -> None:
    first, second = add_sphere("First"), add_sphere("Second")
    second.location.x = 3
    bpy.context.view_layer.update()
    activate(second, first)
    measure_active()
    near = last_lines()[0]
    measure_active(space="world")
    assert near.startswith("max 0 ") or float(near.split()[1]) < 1e-6
    assert float(last_lines()[0].split()[1]) > 1


def test_the_size_of_the_objects_matters() -> None:
    first, second = add_sphere("First"), add_sphere("Second")
    second.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    activate(second, first)
    measure_active()
    assert float(last_lines()[0].split()[1]) == pytest.approx(1, abs=0.05)


def test_a_level_is_measured_against_its_source_though_its_siblings_are_selected() -> None:
    add_sphere()
    bpy.ops.object.eso_lod_generate(ratios="0.5, 0.25")
    measure_active()
    assert bpy.context.window_manager.eso_last_run.title == "Ball_LOD0 against Ball"


def test_one_mesh_alone_is_refused() -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="Select the original, then"):
        measure_active()


def test_three_meshes_are_refused() -> None:
    activate(add_sphere(), add_cube(), add_cube("Third"))
    with pytest.raises(RuntimeError, match="only one mesh besides"):
        measure_active()


def test_a_source_that_is_gone_is_refused() -> None:
    obj = add_sphere()
    bpy.ops.object.eso_simplify(ratio=0.25)
    bpy.data.objects.remove(obj)
    with pytest.raises(RuntimeError, match="Select the original, then"):
        measure_active()


def test_nothing_active() -> None:
    with pytest.raises(RuntimeError, match="No active object"):
        measure_active()


def test_it_has_a_tooltip() -> None:
    assert OBJECT_OT_eso_measure.__doc__
