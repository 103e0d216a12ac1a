# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import bpy
import numpy as np
import pytest

from eso_addon.bridge import lod_sources
from eso_addon.bridge.read_mesh import read_mesh
from eso_addon.core.mesh import MeshError
from eso_addon.core.simplify import lod_chain
from tests.bridge.blender_scenes import activate, add_empty, add_sphere, arrays, linked_from_library

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


@pytest.mark.parametrize("text", ["", "half", "0.5, ,x", "0.5 0.25 -", "nan", "0.5, inf"])
def test_a_list_that_cannot_be_read_is_refused(text: str) -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="write numbers with commas between"):
        generate(ratios=text)


@pytest.mark.parametrize("text", ["0.5, 0", "1.5", "-0.1"])
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


def level_objects() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if "eso_level" in obj]


def test_every_selected_mesh_gets_levels() -> None:
    activate(add_sphere("One", 3), add_sphere("Other", 2))
    generate(ratios="0.5, 0.25", profile="unity")
    assert [o.name for o in level_objects()] == ["One_LOD0", "One_LOD1", "Other_LOD0", "Other_LOD1"]
    assert [o["eso_triangles"] for o in level_objects()] == [160, 80, 40, 20]
    assert {c.name: [o.name for o in c.objects] for c in bpy.context.scene.collection.children} == {
        "One_LODs": ["One_LOD0", "One_LOD1"], "Other_LODs": ["Other_LOD0", "Other_LOD1"]}


def test_every_mesh_of_a_collection_gets_levels() -> None:
    collection = bpy.data.collections.new("Props")
    bpy.context.scene.collection.children.link(collection)
    for name in ("One", "Other"):
        collection.objects.link(add_sphere(name, 2))
    add_sphere("Else", 2)
    generate(ratios="0.5", scope="COLLECTION", source_collection="Props")
    assert [o.name for o in level_objects()] == ["One_LOD0", "Other_LOD0"]
    with pytest.raises(RuntimeError, match="no collection 'Nowhere'"):
        generate(ratios="0.5", scope="COLLECTION", source_collection="Nowhere")


def test_objects_that_share_a_mesh_share_its_levels() -> None:
    one = add_sphere("One", 3)
    other = bpy.data.objects.new("Other", one.data)
    bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    activate(one, other)
    generate(ratios="0.5, 0.25")
    by_name = {o.name: o for o in level_objects()}
    assert by_name["One_LOD1"].data == by_name["Other_LOD1"].data
    assert len(bpy.data.meshes) == 3


def test_instances_of_a_collection_get_levels_once() -> None:
    prop = bpy.data.collections.new("Prop")
    ball = add_sphere("Ball", 3)
    prop.objects.link(ball)
    bpy.context.scene.collection.objects.unlink(ball)
    empties = []
    for number in range(2):
        empty = bpy.data.objects.new(f"Here{number}", None)
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", prop, 3 * number
        bpy.context.scene.collection.objects.link(empty)
        empties.append(empty)
    bpy.context.view_layer.update()
    for ratios in ("0.5", "0.5, 0.25"):
        activate(*empties)
        generate(ratios=ratios)
    shown = [i.object.name for i in bpy.context.evaluated_depsgraph_get().object_instances if i.object.type == "MESH"]
    assert sorted(shown) == ["Ball"] * 2 + ["Ball_LOD0"] * 2 + ["Ball_LOD1"] * 2
    assert bpy.data.objects["Here1_LOD1"].location.x == 3
    assert len(bpy.data.meshes) == 3


def test_instances_within_instances_are_in_every_level() -> None:
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    for collection, name in ((inner, "One"), (outer, "Other")):
        ball = add_sphere(name, 2)
        collection.objects.link(ball)
        bpy.context.scene.collection.objects.unlink(ball)
    nested, top = bpy.data.objects.new("Nested", None), add_empty("Top")
    nested.instance_type, nested.instance_collection, nested.location.z = "COLLECTION", inner, 4
    outer.objects.link(nested)
    top.instance_type, top.instance_collection = "COLLECTION", outer
    bpy.context.view_layer.update()
    for ratios in ("0.5", "0.5, 0.25"):
        activate(top)
        generate(ratios=ratios)
    activate(bpy.data.objects["Top_LOD0"])  # which stands for its source
    generate(ratios="0.5, 0.25")
    shown = [(i.object.name, i.parent.name) for i in bpy.context.evaluated_depsgraph_get().object_instances
             if i.is_instance and i.object.type == "MESH"]
    assert sorted(shown) == [("One", "Top"), ("One_LOD0", "Top_LOD0"), ("One_LOD1", "Top_LOD1"),
                             ("Other", "Top"), ("Other_LOD0", "Top_LOD0"), ("Other_LOD1", "Top_LOD1")]
    assert bpy.data.objects["Nested_LOD1"].location.z == 4
    assert "Nested_LOD1" not in bpy.context.scene.objects
    nested.location.z = 5
    activate(top)
    generate(ratios="0.5, 0.25")
    assert bpy.data.objects["Nested_LOD1"].location.z == 5


def test_a_level_whose_source_is_gone_can_have_levels() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25")
    bpy.data.objects.remove(obj)
    for _ in range(2):
        activate(bpy.data.objects["Ball_LOD0"])
        generate(ratios="0.5")
        assert sorted(o.name for o in bpy.data.objects) == ["Ball_LOD0", "Ball_LOD0_LOD0", "Ball_LOD1"]


def test_a_budget_over_forty_props() -> None:
    props = []
    for number in range(40):
        prop = add_sphere(f"Prop{number}", 2 + number % 2)
        prop.scale = [0.1 + 0.1 * number] * 3
        props.append(prop)
    activate(*props)
    generate(levels_by="budget", budgets="2001")
    found = [o["eso_triangles"] for o in level_objects()]
    assert len(found) == 40
    assert 2001 * 0.999 <= sum(found) <= 2001
    assert f"LOD0 {sum(found):,} (" in bpy.context.window_manager.eso_last_run.lines


def test_levels_by_size_on_screen_know_where_they_begin() -> None:
    add_sphere(subdivisions=3)
    generate(levels_by="screen", screen_sizes="400, 25", lens=36.0, resolution=1000)
    fine, coarse = level_objects()
    assert fine["eso_switch_distance"] == pytest.approx(2 * 1000 / 400, rel=1e-3)  # a ball two units wide
    assert coarse["eso_switch_distance"] == pytest.approx(2 * 1000 / 25, rel=1e-3)
    assert coarse["eso_error"] * 1000 / coarse["eso_switch_distance"] <= 1


def test_levels_of_levels_are_those_of_the_source() -> None:
    add_sphere()
    generate(ratios="0.5, 0.25")
    generate(ratios="0.4, 0.2")  # the levels are selected now
    assert sorted(o.name for o in bpy.data.objects) == ["Ball", "Ball_LOD0", "Ball_LOD1"]
    assert [o["eso_triangles"] for o in level_objects()] == [512, 256]


def test_levels_are_made_again_in_the_same_objects() -> None:
    obj = add_sphere()
    generate(ratios="0.5, 0.25, 0.1")
    before = level_objects()
    activate(obj)
    generate(ratios="0.4, 0.2")
    assert level_objects() == before[:2]
    assert [m.name for m in bpy.data.meshes] == ["Ball", "Ball_LOD0", "Ball_LOD1"]


def test_what_poses_stays_live_and_the_rest_is_applied() -> None:
    obj = add_sphere(subdivisions=3)
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    obj.modifiers.new("Bend", "SIMPLE_DEFORM")
    obj.modifiers.new("Half", "MIRROR")
    obj.modifiers.new("Rig", "ARMATURE").object = rig
    obj.parent = rig
    obj.constraints.new("COPY_LOCATION").target = rig
    generate(ratios="0.5")
    level = level_objects()[0]
    assert [modifier.name for modifier in level.modifiers] == ["Rig"]
    assert level.parent == rig
    assert level.constraints[0].target == rig
    assert level["eso_triangles"] == 320  # of both halves
    activate(obj)
    generate(ratios="0.5", live_mirror=True)
    assert level["eso_triangles"] == 160
    assert [modifier.name for modifier in level.modifiers] == ["Half", "Rig"]
    assert [modifier.show_viewport for modifier in obj.modifiers] == [True] * 3


@pytest.mark.parametrize(("options", "words"), [
    ({"ratios": "0.5, 0.5"}, "is there twice"),
    ({"ratios": "0.9,0.8,0.7,0.6,0.5", "profile": "secondlife"}, "at most 4 levels"),
    ({"ratios": ".9,.8,.7,.6,.5,.4,.3,.2,.1", "profile": "unreal"}, "at most 8 levels"),
    ({"levels_by": "screen", "screen_sizes": "0"}, "Screen size"),
    ({"levels_by": "budget", "budgets": "0.5"}, "cannot be read"),
])
def test_bad_lists_change_nothing(options: dict, words: str) -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match=words):
        generate(**options)
    assert len(bpy.data.objects) == 1
    assert not bpy.data.collections


def test_a_name_that_is_taken_is_refused_before_anything_is_made() -> None:
    obj = add_sphere()
    add_sphere("Ball_LOD1", 1)
    activate(obj)
    with pytest.raises(RuntimeError, match="'Ball_LOD1' is there already"):
        generate(ratios="0.5, 0.25")
    assert len(bpy.data.objects) == 2
    assert not bpy.data.collections
    generate(ratios="0.5")  # which does not need that name
    assert bpy.data.objects["Ball_LOD0"]["eso_level"] == 0


@pytest.mark.parametrize("name", ["Stuhl.001", "Tür ä", "椅子", "x" * 63, "é" * 31])
def test_names_of_every_kind(name: str) -> None:
    obj = add_sphere(name, 2)
    generate(ratios="0.5, 0.25", profile="unity")
    names = [o.name for o in level_objects()]
    assert [n[-5:] for n in names] == ["_LOD0", "_LOD1"]
    assert names[0][:-1] == names[1][:-1]
    assert obj.name.startswith(names[0][:-5])
    assert [o["eso_source"] for o in level_objects()] == [obj.name] * 2


def test_a_linked_source_and_an_override(tmp_path: Path) -> None:
    add_sphere("Far", 2)
    far = linked_from_library(tmp_path, "objects", "Far")
    bpy.context.scene.collection.objects.link(far)
    activate(far)
    generate(ratios="0.5")
    level = bpy.data.objects["Far_LOD0"]
    assert level.library is None
    assert level.data.library is None
    assert level["eso_triangles"] == 40


def test_second_life_names_beside_the_source() -> None:
    add_sphere()
    generate(ratios="0.9, 0.5, 0.2, 0.1", profile="secondlife")
    assert [o.name for o in sorted(level_objects(), key=lambda o: o["eso_level"])] == [
        "Ball_LOD3", "Ball_LOD2", "Ball_LOD1", "Ball_LOD0"]


def test_a_level_out_of_reach_is_no_copy_and_says_what_would_help() -> None:
    add_sphere("Big", 2)
    add_sphere("Small", 1).scale = (0.1, 0.1, 0.1)
    activate(bpy.data.objects["Big"], bpy.data.objects["Small"])
    bpy.ops.object.join()
    generate(levels_by="count", faces_targets="100, 6, 5")
    assert [o["eso_triangles"] for o in level_objects()] == [100, 8]
    assert "stopped at 8 of 6" in level_objects()[1]["eso_message"]
    assert "pruning at" in bpy.context.window_manager.eso_last_run.lines


def test_a_vertex_group_protects_those_that_have_it() -> None:
    one, other = add_sphere("One", 3), add_sphere("Other", 3)
    held = [vertex.index for vertex in one.data.vertices if vertex.co.z > 0.5]
    one.vertex_groups.new(name="Face").add(held, 1.0, "REPLACE")
    places = {tuple(one.data.vertices[index].co) for index in held}
    activate(one, other)
    generate(ratios="0.6", vertex_group="Face", group_use="protect")
    found = {name: {tuple(v.co) for v in bpy.data.objects[name].data.vertices} for name in ("One_LOD0", "Other_LOD0")}
    assert places <= found["One_LOD0"]
    assert not places <= found["Other_LOD0"]
    bpy.ops.object.eso_lod_update(only_stale=False)
    assert places <= {tuple(v.co) for v in bpy.data.objects["One_LOD0"].data.vertices}
    activate(one, other)
    with pytest.raises(RuntimeError, match="no vertex group 'Nose'"):
        generate(ratios="0.6", vertex_group="Nose")


def test_a_library_override_gets_local_levels(tmp_path: Path) -> None:
    far = bpy.data.collections.new("Far")
    bpy.context.scene.collection.children.link(far)
    far.objects.link(add_sphere("Ball", 2))
    linked = linked_from_library(tmp_path, "collections", "Far")
    linked.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer, do_fully_editable=True)
    source = next(obj for obj in bpy.data.objects if obj.override_library is not None)
    bpy.context.view_layer.update()
    activate(source)
    generate(ratios="0.5")
    (level,) = level_objects()
    assert (level.override_library, level.library, level.data.library) == (None, None, None)
    assert level["eso_triangles"] == 40
    assert source.data.library is not None or source.data.override_library is not None


def test_what_cannot_be_written_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    def write_mesh(result: object, source: object, name: str, **options: object) -> bpy.types.Mesh:
        if name.startswith("Other"):
            raise MeshError("the result has coordinates too large for Blender: scale the mesh down")
        return bpy.data.meshes.new(name)

    monkeypatch.setattr(lod_sources, "write_mesh", write_mesh)
    activate(add_sphere("One", 2), add_sphere("Other", 2))
    with pytest.raises(RuntimeError, match="too large"):
        generate(ratios="0.5")
    assert sorted(mesh.name for mesh in bpy.data.meshes) == ["One", "Other"]
    assert len(bpy.data.objects) == 2
    assert not bpy.data.collections
