# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels made again in place, and the marks of those whose source was edited."""

from pathlib import Path

import bpy
import pytest

from tests.bridge.blender_scenes import activate, add_mesh, add_sphere, arrays

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate
update = bpy.ops.object.eso_lod_update


def levels() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if "eso_level" in obj]


def edit(obj: bpy.types.Object) -> None:
    for vertex in obj.data.vertices:
        vertex.co.z *= 2
    obj.data.update()
    bpy.context.view_layer.update()


def test_levels_are_stale_once_their_source_is_edited() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25")
    assert [level["eso_stale"] for level in levels()] == [False, False]
    obj.location.x = 5
    obj.select_set(True)
    bpy.context.view_layer.update()
    assert [level["eso_stale"] for level in levels()] == [False, False]
    edit(obj)
    assert [level["eso_stale"] for level in levels()] == [True, True]
    for vertex in obj.data.vertices:  # as an undo would
        vertex.co.z /= 2
    obj.data.update()
    bpy.context.view_layer.update()
    assert [level["eso_stale"] for level in levels()] == [False, False]


@pytest.mark.parametrize("change", ["uv", "material", "group", "weight", "modifier"])
def test_whatever_levels_are_made_from_makes_them_stale(change: str) -> None:
    obj = add_sphere()
    leg = obj.vertex_groups.new(name="Leg")
    leg.add([0, 1], 0.5, "REPLACE")
    generate(ratios="0.5")
    if change == "uv":
        obj.data.uv_layers[0].data[0].uv.x += 0.5
    elif change == "material":
        obj.data.materials.append(bpy.data.materials.new("Paint"))
        obj.data.materials.append(bpy.data.materials.new("Gold"))
        obj.data.polygons[3].material_index = 1
    elif change == "group":
        obj.vertex_groups.new(name="Arm")
    elif change == "weight":
        leg.add([1], 0.75, "REPLACE")
    else:
        obj.modifiers.new("Smooth", "SMOOTH")
    obj.data.update()
    bpy.context.view_layer.update()
    assert levels()[0]["eso_stale"]


def test_levels_are_made_again_in_place() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25", profile="unity")
    fine, coarse = levels()
    coarse.location.y = 7
    other = bpy.data.objects.new("Linked", coarse.data)
    extra = bpy.data.collections.new("Extra")
    extra.objects.link(coarse)
    cheap = bpy.data.materials.new("Cheap")
    coarse.data.materials.append(cheap)
    edit(obj)
    names = sorted(o.name for o in bpy.data.objects), sorted(m.name for m in bpy.data.meshes)
    assert update() == {"FINISHED"}
    assert (sorted(o.name for o in bpy.data.objects), sorted(m.name for m in bpy.data.meshes)) == names
    assert levels() == [fine, coarse]
    assert max(point[2] for point in arrays(coarse)[0]) > 1.5
    assert other.data == coarse.data
    assert list(coarse.data.materials) == [cheap]
    assert coarse.location.y == 7
    assert coarse.name in extra.objects
    assert [level["eso_stale"] for level in levels()] == [False, False]
    assert [level["eso_triangles"] for level in levels()] == [640, 320]


def test_materials_that_were_not_changed_follow_the_source() -> None:
    obj = add_sphere()
    obj.data.materials.append(bpy.data.materials.new("Old"))
    generate(ratios="0.5")
    obj.data.materials[0] = bpy.data.materials.new("New")
    update(only_stale=False)
    assert levels()[0].data.materials[0].name == "New"


def test_levels_that_are_up_to_date_are_left_alone() -> None:
    add_sphere()
    generate(ratios="0.5")
    mesh = levels()[0].data
    update()
    assert levels()[0].data == mesh
    assert "up to date" in bpy.context.window_manager.eso_last_run.lines


def test_only_the_selected_are_made_again() -> None:
    one, other = add_sphere("One", 2), add_sphere("Other", 2)
    activate(one, other)
    generate(ratios="0.5")
    edit(one)
    edit(other)
    activate(one)
    update(which="SELECTED")
    assert {level["eso_source"]: level["eso_stale"] for level in levels()} == {"One": False, "Other": True}


def test_a_level_that_was_deleted_stays_away() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25, 0.1")
    bpy.data.objects.remove(levels()[1])
    edit(obj)
    update()
    assert [level["eso_triangles"] for level in levels()] == [640, 128]
    assert len([mesh for mesh in bpy.data.meshes if mesh.users]) == 3


def test_a_source_that_was_renamed_is_found() -> None:
    obj = add_sphere()
    generate(ratios="0.5")
    obj.name = "Globe"
    edit(obj)
    update()
    assert levels()[0]["eso_source"] == "Globe"
    assert not levels()[0]["eso_stale"]


def test_a_share_of_a_budget_is_kept() -> None:
    one, other = add_sphere("One", 3), add_sphere("Other", 3)
    other.scale = (4, 4, 4)
    activate(one, other)
    generate(levels_by="budget", budgets="200")
    before = [level["eso_triangles"] for level in levels()]
    edit(one)
    update()
    assert [level["eso_triangles"] for level in levels()] == before
    assert sum(before) in (199, 200)


def test_a_source_that_is_gone() -> None:
    obj = add_sphere()
    generate(ratios="0.5")
    bpy.data.objects.remove(obj)
    bpy.context.view_layer.update()
    activate(levels()[0])
    with pytest.raises(RuntimeError, match="'Ball', the source of 'Ball_LOD0', is gone"):
        update(which="SELECTED", only_stale=False)


def test_levels_without_readable_settings() -> None:
    add_sphere()
    generate(ratios="0.5")
    levels()[0]["eso_settings"] = "{}"
    with pytest.raises(RuntimeError, match="generate them anew"):
        update(only_stale=False)


@pytest.mark.parametrize("use", ["protect", "favour"])
def test_a_vertex_group_that_is_gone_is_missed(use: str) -> None:
    one, other = add_sphere("One", 3), add_sphere("Other", 3)
    group = one.vertex_groups.new(name="Face")
    group.add([vertex.index for vertex in one.data.vertices if vertex.co.z > 0], 1.0, "REPLACE")
    activate(one, other)
    generate(ratios="0.6", vertex_group="Face", group_use=use)
    group.name = "Head"
    edit(one)
    edit(other)
    before = [level.data for level in levels()]
    with pytest.raises(RuntimeError, match="'One' has no vertex group 'Face' any more.*generate them anew"):
        update()
    assert [level.data for level in levels()] == before
    activate(other)
    update(which="SELECTED")  # which never had it
    group.name = "Face"
    update()
    assert [level["eso_stale"] for level in levels()] == [False, False]


def test_without_levels() -> None:
    add_mesh("Plain", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    with pytest.raises(RuntimeError, match="No levels"):
        update()


def test_copies_that_the_user_made_stay(tmp_path: Path) -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25")
    fine = levels()[0]
    copy, twin = fine.copy(), fine.copy()
    twin.data = fine.data.copy()
    for other in (copy, twin):
        fine.users_collection[0].objects.link(other)
    activate(obj)
    generate(ratios="0.4, 0.2")
    assert len(levels()) == 4
    assert copy.data == fine.data != twin.data
    bpy.ops.object.eso_lod_export(filepath=str(tmp_path / "levels.glb"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "levels.glb"))
    assert sorted(o.name for o in bpy.data.objects) == ["Ball_LOD0", "Ball_LOD1"]
