# SPDX-License-Identifier: GPL-3.0-or-later
"""What a finished character or prop carries is there after object.eso_simplify, and the source is untouched."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from eso_addon.bridge.selection import MARK
from tests.bridge.blender_scenes import activate, add_sphere, linked_from_library

pytestmark = pytest.mark.usefixtures("addon")
simplify_active = bpy.ops.object.eso_simplify


def character() -> bpy.types.Object:
    """Add a ball with all that a mesh can carry."""
    obj = add_sphere()
    mesh = obj.data
    for name in ("Skin", "Cloth"):
        mesh.materials.append(bpy.data.materials.new(name))
    for polygon in mesh.polygons:
        polygon.material_index = int(polygon.center.z > 0)
        polygon.use_smooth = True
    for name, data_type, domain in (("Heat", "FLOAT", "POINT"), ("Paint", "BYTE_COLOR", "CORNER"),
                                    ("Tint", "FLOAT_COLOR", "POINT"), ("Room", "INT", "FACE"),
                                    ("Note", "STRING", "FACE"), ("crease_edge", "FLOAT", "EDGE"),
                                    ("bevel_weight_edge", "FLOAT", "EDGE")):
        mesh.attributes.new(name, data_type, domain)
    heat = np.array([vertex.co.z for vertex in mesh.vertices], np.float32)
    mesh.attributes["Heat"].data.foreach_set("value", heat)
    mesh.edges[3].use_seam = mesh.edges[9].use_edge_sharp = True
    for name, low in (("Upper", 0.0), ("Lower", -2.0)):
        group = obj.vertex_groups.new(name=name)
        group.add([v.index for v in mesh.vertices if low <= v.co.z < low + 2.0], 1.0, "REPLACE")
    obj.shape_key_add(name="Basis")
    smile = obj.shape_key_add(name="Smile", from_mix=False)
    for point in smile.points:
        point.co.x += 0.5 * max(point.co.z, 0.0)
    smile.value, smile.slider_max = 0.25, 2.0
    smile.driver_add("value").driver.expression = "0.25"
    mesh["origin"] = "scan 7"
    mesh.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(mesh.loops))
    activate(obj)
    return obj


@pytest.mark.parametrize("ratio", [1.0, 0.3])
def test_all_of_it_is_carried(ratio: float) -> None:
    obj = character()
    simplify_active(ratio=ratio)
    mesh = bpy.context.object.data
    names = {attribute.name for attribute in mesh.attributes}
    assert {"UVMap", "Heat", "Paint", "Tint", "Room", "Note", "crease_edge", "bevel_weight_edge", "uv_seam",
            "sharp_edge"} <= names | {name.lstrip(".") for name in names}
    heat = np.array([item.value for item in mesh.attributes["Heat"].data])
    assert np.abs(heat - [vertex.co.z for vertex in mesh.vertices]).max() < 0.1
    normals = np.zeros(len(mesh.loops) * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    assert (normals.reshape(-1, 3) @ [0, 0.6, 0.8]).min() > 0.9999
    keys = mesh.shape_keys
    assert keys.key_blocks.keys() == ["Basis", "Smile"]
    assert (keys.key_blocks["Smile"].slider_max, keys.animation_data.drivers[0].driver.expression) == (2.0, "0.25")
    for point, basis in zip(keys.key_blocks["Smile"].points, keys.key_blocks["Basis"].points, strict=True):
        assert abs(point.co.x - basis.co.x - 0.5 * max(basis.co.z, 0.0)) < 0.05
    assert [group.name for group in bpy.context.object.vertex_groups] == ["Upper", "Lower"]
    assert [material.name for material in mesh.materials] == ["Skin", "Cloth"]
    assert mesh["origin"] == "scan 7"
    assert not mesh.validate()
    assert (len(obj.data.shape_keys.key_blocks), len(obj.data.polygons)) == (2, 1280)


def test_absolute_keys_stand_where_they_stood() -> None:
    obj = add_sphere()
    obj.shape_key_add(name="Basis")
    obj.data.shape_keys.use_relative = False
    for time in (35.0, 70.0):
        obj.data.shape_keys.eval_time = time
        obj.shape_key_add(name=f"At {time}", from_mix=False)
    simplify_active(ratio=0.4)
    keys = bpy.context.object.data.shape_keys
    assert not keys.use_relative
    assert [block.frame for block in keys.key_blocks] == [block.frame for block in obj.data.shape_keys.key_blocks]


def rigged() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Add a ball that two bones move, with weights that do not sum to one and some vertices without any."""
    bpy.ops.object.armature_add()
    armature = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("Upper", "Lower"):
        armature.data.edit_bones.new(name).tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj = add_sphere()
    for name, sign in (("Upper", 1), ("Lower", -1), ("Mask", 1)):
        group = obj.vertex_groups.new(name=name)
        for vertex in obj.data.vertices:
            if abs(vertex.co.z) < 0.9:
                group.add([vertex.index], min(max(0.4 + 0.3 * sign * vertex.co.z, 0.0), 1.0), "REPLACE")
    obj.modifiers.new("Rig", "ARMATURE").object = armature
    return obj, armature


@pytest.mark.parametrize("limit", [-1, 1])
def test_weights_of_bones_are_normalised_and_limited(limit: int) -> None:
    obj, armature = rigged()
    simplify_active(ratio=0.3, influences=limit)
    new = bpy.context.object
    assert new.modifiers["Rig"].object == armature
    for vertex in new.data.vertices:
        weights = [element.weight for element in vertex.groups if new.vertex_groups[element.group].name != "Mask"]
        assert len(weights) <= (2 if limit < 0 else limit)
        assert not weights or sum(weights) == pytest.approx(1, abs=1e-5)
    assert len(obj.data.vertices) == 642


def joined_by_nodes() -> bpy.types.Object:
    """Give a sphere that geometry nodes join with another, which has a vertex group of another name."""
    other, obj = add_sphere(), add_sphere()
    for owner, name, weight in ((other, "Theirs", 0.25), (obj, "Mine", 0.75)):
        owner.vertex_groups.new(name=name).add(range(len(owner.data.vertices)), weight, "REPLACE")
    other.data.transform(Matrix.Translation((4, 0, 0)))
    tree = bpy.data.node_groups.new("Join", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, info, join, end = (tree.nodes.new(kind) for kind in (
        "NodeGroupInput", "GeometryNodeObjectInfo", "GeometryNodeJoinGeometry", "NodeGroupOutput"))
    info.inputs[0].default_value = other
    for output in (start.outputs[0], info.outputs["Geometry"]):  # the last comes first
        tree.links.new(output, join.inputs[0])
    tree.links.new(join.outputs[0], end.inputs[0])
    obj.modifiers.new("Join", "NODES").node_group = tree
    activate(obj)
    return obj


def check_joined(obj: bpy.types.Object) -> None:
    """Check the groups of such an object where its modifier is applied."""
    assert {group.name for group in obj.vertex_groups} == {"Mine", "Theirs"}
    for vertex in obj.data.vertices:
        found = {obj.vertex_groups[element.group].name: element.weight for element in vertex.groups}
        assert found == ({"Theirs": 0.25} if vertex.co.x > 2 else {"Mine": 0.75})


def test_groups_that_geometry_nodes_bring_keep_their_names() -> None:
    joined_by_nodes()
    simplify_active(ratio=0.3)
    check_joined(bpy.context.object)


def test_simulations_and_armatures_stay_live_while_others_are_applied() -> None:
    obj, _ = rigged()
    obj.modifiers.new("Cloth", "CLOTH")
    obj.modifiers.new("Thick", "SOLIDIFY")
    simplify_active(ratio=0.5)
    assert [modifier.type for modifier in bpy.context.object.modifiers] == ["ARMATURE", "CLOTH"]
    assert len(bpy.context.object.data.polygons) == 1280
    assert [modifier.type for modifier in obj.modifiers] == ["ARMATURE", "CLOTH", "SOLIDIFY"]
    assert all(modifier.show_viewport for modifier in obj.modifiers)


@pytest.mark.parametrize("in_place", [True, False])
@pytest.mark.parametrize("kind", ["PARTICLE_SYSTEM", "FLUID", "COLLISION", "DYNAMIC_PAINT"])
def test_simulations_go_on(kind: str, in_place: bool) -> None:
    obj = add_sphere()
    modifier = obj.modifiers.new("Simulated", kind)
    if kind == "FLUID":
        modifier.fluid_type = "FLOW"
    simplify_active(ratio=0.5, in_place=in_place)
    new = bpy.context.object
    assert [modifier.type for modifier in new.modifiers] == [kind]
    assert len(new.particle_systems) == (kind == "PARTICLE_SYSTEM")
    assert len(new.data.polygons) == 640


def test_polygons_that_have_not_changed_stay_what_they_were() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    obj = bpy.context.object
    group = obj.vertex_groups.new(name="Face")
    group.add([vertex.index for vertex in obj.data.vertices if vertex.co.z > 0], 1.0, "REPLACE")
    simplify_active(ratio=0.7, vertex_group="Face", group_use="protect")
    high = [polygon for polygon in bpy.context.object.data.polygons if polygon.center.z > 0.2]
    assert len(high) == len([polygon for polygon in obj.data.polygons if polygon.center.z > 0.2])
    assert {len(polygon.vertices) for polygon in high} == {3, 4}
    activate(obj)
    simplify_active(ratio=1.0)
    assert outlines(bpy.context.object) == outlines(obj)


def outlines(obj: bpy.types.Object) -> set[tuple]:
    """Give where the corners of each polygon are, in their order."""
    return {tuple(tuple(obj.data.vertices[v].co) for v in polygon.vertices) for polygon in obj.data.polygons}


@pytest.mark.parametrize("kind", ["", "TRIANGULATE", "WELD", "EDGE_SPLIT"])
def test_only_the_selection_in_edit_mode(kind: str) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    obj = bpy.context.object
    if kind:
        obj.modifiers.new("Some", kind)
    select_faces(obj, lambda center: center.z > 0)
    before = {tuple(v.co) for v in obj.data.vertices if v.co.z < -0.05}
    simplify_active(ratio=0.5)
    after = {tuple(v.co) for v in bpy.context.object.data.vertices if v.co.z < -0.05}
    assert before == after
    assert bpy.context.object["eso_triangles"] == pytest.approx(480 + 240, abs=2)
    assert not any(MARK in made.data.attributes for made in (obj, bpy.context.object))


def select_faces(obj: bpy.types.Object, chosen: Callable[[Vector], bool]) -> None:
    """Select faces by their centres and switch to Edit Mode."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    for polygon in obj.data.polygons:
        polygon.select = chosen(polygon.center)
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.parametrize("action", ["SELECT", "DESELECT"])
@pytest.mark.parametrize("kind", ["TRIANGULATE", "REMESH"])
def test_all_or_no_faces_selected_means_the_whole_mesh(kind: str, action: str) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.context.object.modifiers.new("Some", kind)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action=action)
    simplify_active(ratio=0.5)
    assert bpy.context.object["eso_ratio"] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("kind", "message"), [("REMESH", "apply them first"), ("MASK", "leave nothing")])
def test_a_selection_that_modifiers_lose_is_refused(kind: str, message: str) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    obj = bpy.context.object
    below = obj.vertex_groups.new(name="Below")
    below.add([vertex.index for vertex in obj.data.vertices if vertex.co.z < 0.1], 1.0, "REPLACE")
    modifier = obj.modifiers.new("Some", kind)
    if kind == "MASK":
        modifier.vertex_group = "Below"
    select_faces(obj, lambda center: center.z > 0.5)
    with pytest.raises(RuntimeError, match=message):
        simplify_active(ratio=0.5)
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert MARK not in obj.data.attributes
    assert all(polygon.select == (polygon.center.z > 0.5) for polygon in obj.data.polygons)


@pytest.mark.parametrize("name", ["vertex groups", "shape keys", "custom normals"])
def test_an_attribute_may_have_any_name(name: str) -> None:
    obj = character()
    obj.data.attributes.new(name, "INT", "POINT").data.foreach_set("value", np.arange(len(obj.data.vertices)))
    assert simplify_active(ratio=1.0) == {"FINISHED"}
    new = bpy.context.object.data
    assert sorted(item.value for item in new.attributes[name].data) == list(range(len(new.vertices)))
    assert len(new.shape_keys.key_blocks) == len(bpy.context.object.vertex_groups) == 2


@pytest.mark.parametrize("keep", [True, False])
def test_loose_points_and_edges_stay_or_go(keep: bool) -> None:
    obj = add_sphere()
    mesh = obj.data
    mesh.vertices.add(3)
    mesh.vertices[-1].co = (0, 0, 5)
    mesh.edges.add(1)
    mesh.edges[-1].vertices = (642, 643)
    mesh.update()
    simplify_active(ratio=0.3, keep_loose=keep)
    assert sum(edge.is_loose for edge in bpy.context.object.data.edges) == keep
    assert any(tuple(v.co) == (0, 0, 5) for v in bpy.context.object.data.vertices) == keep


def test_not_a_number_in_a_uv_map_is_told() -> None:
    obj = add_sphere()
    obj.data.uv_layers[0].data[5].uv = (float("nan"), 0)
    simplify_active(ratio=0.3)
    uv = np.array([item.uv for item in bpy.context.object.data.uv_layers[0].data])
    assert np.isfinite(uv).all()
    assert "UVMap has 1 values that are not finite" in bpy.context.window_manager.eso_last_run.lines
    assert np.isnan(obj.data.uv_layers[0].data[5].uv[0])


def test_a_library_override_gives_a_local_result(tmp_path: Path) -> None:
    add_sphere("Far")
    linked = linked_from_library(tmp_path, "objects", "Far")
    bpy.context.scene.collection.objects.link(linked)
    override = linked.override_create(remap_local_usages=True)
    activate(override)
    simplify_active(ratio=0.3)
    new = bpy.context.object
    assert new.override_library is None
    assert new.data.library is None
    assert "UVMap" in new.data.uv_layers
    activate(override)
    with pytest.raises(RuntimeError, match="make it local first"):
        simplify_active(ratio=0.3, in_place=True)


def test_a_group_that_is_not_there_is_refused() -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="no vertex group 'Hand'"):
        simplify_active(ratio=0.3, vertex_group="Hand")


def test_a_mesh_that_is_not_symmetric_is_refused() -> None:
    add_sphere().data.vertices[7].co.x += 0.2
    with pytest.raises(RuntimeError, match="not symmetric over X"):
        simplify_active(ratio=0.3, symmetry="x")
