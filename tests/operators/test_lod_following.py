# SPDX-License-Identifier: GPL-3.0-or-later
"""A level that is made again is what a new one would be, in the same object; the user's own things stay."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from eso_addon.bridge.fingerprint import modifier_settings
from tests.bridge.blender_scenes import activate, add_empty, add_rig, add_sphere

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate


def hang(obj: bpy.types.Object) -> None:
    parent = add_empty("Parent")
    parent.location, parent.scale = (1, 2, 3), (2, 1, 1)
    bpy.context.view_layer.update()
    obj.parent, obj.matrix_parent_inverse = parent, parent.matrix_world.inverted()


def hang_on_a_bone(obj: bpy.types.Object) -> None:
    obj.parent, obj.parent_type, obj.parent_bone = add_rig(), "BONE", "Bone"


def turn(obj: bpy.types.Object) -> None:
    obj.rotation_mode, obj.rotation_quaternion = "QUATERNION", (0.5, 0.5, 0.5, 0.5)
    obj.location, obj.delta_location, obj.scale = (5, 0, 0), (0, 0, 1), (1, 2, -1)


def hold(obj: bpy.types.Object) -> None:
    obj.constraints.new("COPY_LOCATION").target = empty = add_empty("Target")
    empty.location.x = 4


def move(obj: bpy.types.Object) -> None:
    obj.location.x = 2
    obj.keyframe_insert("location", frame=1)
    obj.driver_add("scale", 0).driver.expression = "2"


def pose(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Rig", "ARMATURE").object = add_rig()


def shape(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Half", "MIRROR").use_clip = True
    obj.modifiers.new("Row", "ARRAY").count = 3
    obj.modifiers.new("Warp", "WARP").falloff_type = "CURVE"
    obj.modifiers["Warp"].falloff_curve.curves[0].points[0].location.y = 0.3
    obj.modifiers.new("Cloth", "CLOTH").settings.quality = 9


def mirror(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Row", "ARRAY").count = 3
    obj.modifiers.new("Half", "MIRROR").use_clip = True


def let_go(obj: bpy.types.Object) -> None:
    obj.parent = None
    obj.animation_data_clear()
    obj.constraints.clear()
    obj.modifiers.clear()


def state(obj: bpy.types.Object) -> dict[str, Any]:
    bpy.context.view_layer.update()
    animated = obj.animation_data
    return {
        "place": np.round(obj.matrix_world, 5).tolist(), "size": [round(side, 3) for side in obj.dimensions],
        "mode": obj.rotation_mode, "parent": (obj.parent, obj.parent_type, obj.parent_bone),
        "constraints": [(one.type, one.target) for one in obj.constraints],
        "animation": animated and (animated.action, [driver.data_path for driver in animated.drivers]),
        "modifiers": [modifier.name for modifier in obj.modifiers], "settings": modifier_settings(obj),
        "properties": sorted(set(obj.keys())),
    }


def new_levels(obj: bpy.types.Object, **options: object) -> list[dict[str, Any]]:
    for level in [other for other in bpy.data.objects if "eso_level" in other]:
        bpy.data.objects.remove(level)
    return levels(obj, **options)


def levels(obj: bpy.types.Object, **options: object) -> list[dict[str, Any]]:
    activate(obj)
    generate(ratios="0.5, 0.25", **options)
    return [state(other) for other in bpy.data.objects if "eso_level" in other]


@pytest.mark.parametrize("options", [{}, {"live_mirror": True}, {"apply_modifiers": False}], ids=str)
@pytest.mark.parametrize("change", [hang, hang_on_a_bone, turn, hold, move, pose, shape, mirror])
def test_made_again_is_as_made_anew(change: Callable[[bpy.types.Object], None], options: dict) -> None:
    obj = add_sphere(subdivisions=3)
    levels(obj)
    before = [other for other in bpy.data.objects if "eso_level" in other]
    for step in (change, let_go):
        step(obj)
        again = levels(obj, **options)
        assert [other for other in bpy.data.objects if "eso_level" in other] == before
        bpy.ops.ed.undo_push(message="again")
        kept = [(level, level.name) for level in before]
        for level, name in kept:
            level.name, level["eso_source"] = f"Kept {name}", "Nobody"
            del level["eso_level"]
        assert new_levels(obj, **options) == again
        for level in [other for other in bpy.data.objects if "eso_level" in other]:
            bpy.data.objects.remove(level)
        for number, (level, name) in enumerate(kept):
            level.name, level["eso_source"], level["eso_level"] = name, obj.name, number


def test_modifiers_of_the_second_run_are_those_that_show() -> None:
    obj = add_sphere(subdivisions=3)
    obj.data.transform(Matrix.Translation((1.2, 0, 0)))
    obj.modifiers.new("Half", "MIRROR")
    generate(ratios="0.5")
    for options in ({"live_mirror": True}, {"apply_modifiers": False}, {}):
        activate(obj)
        generate(ratios="0.5", **options)
        bpy.context.view_layer.update()
        assert bpy.data.objects["Ball_LOD0"].dimensions.x == pytest.approx(4.4, rel=0.02)


def test_what_the_user_added_to_a_level_stays() -> None:
    obj = add_sphere(subdivisions=3)
    generate(ratios="0.5")
    level = bpy.data.objects["Ball_LOD0"]
    level.modifiers.new("Mine", "WELD")
    level["mine"], level.hide_render = 7, True
    obj.modifiers.new("Rig", "ARMATURE")
    activate(obj)
    generate(ratios="0.5")
    assert [modifier.name for modifier in level.modifiers] == ["Rig", "Mine"]
    assert (level["mine"], level.hide_render) == (7, True)
    obj.modifiers.clear()
    activate(obj)
    generate(ratios="0.5")
    assert [modifier.name for modifier in level.modifiers] == ["Mine"]


def test_update_takes_over_modifiers_that_were_edited_and_leaves_the_place() -> None:
    obj = add_sphere(subdivisions=3)
    obj.modifiers.new("Row", "ARRAY").count = 2
    generate(ratios="0.5", apply_modifiers=False)
    level = bpy.data.objects["Ball_LOD0"]
    level.location.y = 7
    level.modifiers.new("Mine", "WELD")
    obj.modifiers["Row"].count = 5
    obj.modifiers.new("Thick", "SOLIDIFY")
    bpy.ops.object.eso_lod_update()
    assert [modifier.name for modifier in level.modifiers] == ["Row", "Thick", "Mine"]
    assert level.modifiers["Row"].count == 5
    assert level.location.y == 7
    level.modifiers["Row"].show_viewport = False
    obj.data.vertices[0].co.x += 1
    bpy.ops.object.eso_lod_update(only_stale=False)
    assert not level.modifiers["Row"].show_viewport  # nobody edited the source's


def test_a_result_of_a_level_is_no_level() -> None:
    add_sphere()
    generate(ratios="0.5, 0.25")
    activate(bpy.data.objects["Ball_LOD1"])
    bpy.ops.object.eso_simplify(ratio=0.5)
    result = bpy.context.object
    assert {key for key in result.keys() if key.startswith("eso_")} == {  # noqa: SIM118 - an ID is no dictionary
        "eso_source", "eso_triangles", "eso_ratio", "eso_error"}
    for _ in range(2):
        activate(result)
        generate(ratios="0.5")
    assert sorted(o.name for o in bpy.data.objects) == [
        "Ball", "Ball_LOD0", "Ball_LOD1", "Ball_LOD1_ESO", "Ball_LOD1_ESO_LOD0"]


def test_a_result_of_a_streams_mesh_follows_no_stream(tmp_path: Path) -> None:
    add_sphere(subdivisions=2)
    bpy.ops.export_mesh.esopm(filepath=str(tmp_path / "ball.esopm"), use_selection=True)
    bpy.ops.import_mesh.esopm(filepath=str(tmp_path / "ball.esopm"))
    source = bpy.context.object
    bpy.ops.object.eso_simplify(ratio=0.5)
    assert source.eso_stream.path
    assert not bpy.context.object.eso_stream.path


@pytest.mark.parametrize("kind", ["ARMATURE", "LATTICE"])
@pytest.mark.parametrize("in_place", [True, False])
def test_a_parent_that_bends_stays_live(kind: str, in_place: bool) -> None:
    obj = add_sphere(subdivisions=3)
    if kind == "ARMATURE":
        parent = add_rig()
        obj.vertex_groups.new(name="Bone").add(range(len(obj.data.vertices)), 1.0, "REPLACE")
    else:
        parent = bpy.data.objects.new("Lattice", bpy.data.lattices.new("Lattice"))
        bpy.context.scene.collection.objects.link(parent)
        parent.scale = (4, 4, 4)
    obj.parent, obj.parent_type = parent, kind
    obj.matrix_parent_inverse = Matrix.Translation((3, 0, 0))
    obj.modifiers.new("Triangles", "TRIANGULATE")
    if kind == "ARMATURE":
        parent.pose.bones["Bone"].location.y = 5
    else:
        for point in parent.data.points:
            point.co_deform.z += 1
    before = shown_at(obj)
    assert abs(before[2]) > 3
    activate(obj)
    bpy.ops.object.eso_simplify(ratio=0.5, in_place=in_place)
    assert shown_at(bpy.context.object) == pytest.approx(before, abs=0.1)
    assert obj.parent_type == kind
    assert obj.matrix_parent_inverse[0][3] == 3


def shown_at(obj: bpy.types.Object) -> list[float]:
    bpy.context.view_layer.update()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    corners = np.array([evaluated.matrix_world @ vertex.co for vertex in evaluated.data.vertices])
    return ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
