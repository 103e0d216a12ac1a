# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from eso_addon.bridge.read_mesh import GROUPS, KEYS, NORMALS, read_mesh, scale_transform
from eso_addon.core.mesh import MeshError
from tests.bridge.blender_scenes import add_cube, add_mesh, add_sphere, arrays, linked_from_library


def test_positions_and_triangles_are_blenders_own() -> None:
    obj = add_sphere()
    read = read_mesh(obj)
    positions, triangles = arrays(obj)
    assert read.vertices.dtype == np.float64
    assert read.triangles.dtype == np.int64
    assert np.array_equal(read.vertices, positions)
    assert np.array_equal(read.triangles, triangles)
    assert np.array_equal(read.transform, np.eye(4))


def test_polygons_are_cut_as_blender_cuts_them() -> None:
    concave = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0)]
    obj = add_mesh("Arrow", concave, [(0, 1, 2, 3, 4)])
    read = read_mesh(obj)
    assert np.array_equal(read.triangles, arrays(obj)[1])
    assert np.array_equal(read.triangle_polygon, [0, 0, 0])
    edges = read.vertices[read.triangles[:, 1:]] - read.vertices[read.triangles[:, :1]]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2
    assert area == pytest.approx(2.5)


def test_corners_and_vertices_agree() -> None:
    obj = add_cube()
    read = read_mesh(obj)
    corner_vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    assert np.array_equal(corner_vertex[read.triangle_corners], read.triangles)


def test_materials_and_smooth_faces() -> None:
    obj = add_cube()
    for name in ("Red", "Blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = polygon.index % 2
        polygon.use_smooth = polygon.index == 3
    read = read_mesh(obj)
    assert [material.name for material in read.materials if material] == ["Red", "Blue"]
    assert np.array_equal(read.material_index, read.triangle_polygon % 2)
    assert np.array_equal(read.smooth, read.triangle_polygon == 3)


def test_modifiers_are_applied_or_not() -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 2
    assert len(read_mesh(obj, apply_modifiers=False).triangles) == 12
    assert len(read_mesh(obj).triangles) == 192
    assert len(obj.data.polygons) == 6


def test_shape_keys_count_as_applied() -> None:
    obj = add_cube()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Up", from_mix=False)
    for point in key.data:
        point.co.z += 5
    key.value = 1.0
    assert read_mesh(obj).vertices[:, 2].min() == pytest.approx(4)
    assert read_mesh(obj, apply_modifiers=False).vertices[:, 2].min() == pytest.approx(-1)


def test_materials_that_modifiers_bring_are_originals() -> None:
    obj = add_cube()
    obj.data.materials.append(bpy.data.materials.new("Red"))
    obj.modifiers.new("Subdivide", "SUBSURF")
    assert read_mesh(obj).materials == (bpy.data.materials["Red"],)


@pytest.mark.parametrize("apply_modifiers", [True, False])
def test_edit_mode_gives_the_current_state(apply_modifiers: bool) -> None:
    obj = add_cube()
    obj.modifiers.new("Mirror", "MIRROR").use_axis[0] = False
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    read = read_mesh(obj, apply_modifiers=apply_modifiers)
    assert len(read.triangles) == 48
    assert np.array_equal(np.unique(read.vertices), [-1, 0, 1])
    assert obj.mode == "EDIT"


def test_a_mesh_that_another_object_edits_is_read() -> None:
    obj = add_cube()
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.scene.collection.objects.link(other)
    bpy.ops.object.mode_set(mode="EDIT")
    assert len(read_mesh(other).vertices) == 8


def test_a_hidden_object_is_read_with_its_modifiers() -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 2
    obj.hide_set(True)
    assert len(read_mesh(obj).triangles) == 192


def test_a_disabled_object_with_modifiers_is_refused() -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 2
    obj.hide_viewport = True
    with pytest.raises(MeshError, match="disabled in the viewport"):
        read_mesh(obj)
    assert len(read_mesh(obj, apply_modifiers=False).triangles) == 12


def test_linked_data_is_read(tmp_path: Path) -> None:
    add_sphere("Far")
    obj = linked_from_library(tmp_path, "objects", "Far")
    assert obj.library is not None
    bpy.context.scene.collection.objects.link(obj)
    assert len(read_mesh(obj).triangles) == len(obj.data.polygons)


def test_no_scale_is_exactly_none_however_it_is_turned() -> None:
    obj = add_cube()
    obj.rotation_euler = (0.3, 1.1, -2.0)
    obj.location = (5, 6, 7)
    bpy.context.view_layer.update()
    assert np.array_equal(scale_transform(obj), np.eye(4))


@pytest.mark.parametrize("scale", [(3, 3, 3), (1, 2, 0.5), (-1, 1, 2), (1e-3, 1e3, 1)])
def test_lengths_are_those_of_the_scene(scale: tuple) -> None:
    obj = add_sphere(subdivisions=2)
    obj.scale = scale
    obj.rotation_euler = (0.3, 1.1, -2.0)
    bpy.context.view_layer.update()
    _same_lengths_as_in_the_scene(obj)


def test_lengths_are_those_of_the_scene_when_a_parent_shears() -> None:
    parent = add_cube("Parent")
    parent.scale = (1, 4, 0.5)
    obj = add_sphere(subdivisions=2)
    obj.parent = parent
    obj.rotation_euler = (0.7, 0.2, 0.4)
    bpy.context.view_layer.update()
    _same_lengths_as_in_the_scene(obj)


def _same_lengths_as_in_the_scene(obj: bpy.types.Object) -> None:
    local = arrays(obj)[0]
    matrix = np.array(obj.matrix_world)
    world = local @ matrix[:3, :3].T
    read = read_mesh(obj).vertices
    assert np.allclose(
        np.linalg.norm(read - read[0], axis=1), np.linalg.norm(world - world[0], axis=1), rtol=1e-5, atol=1e-6
    )


def test_a_given_transform_replaces_the_scale() -> None:
    obj = add_cube()
    obj.matrix_world = Matrix.Translation((1, 2, 3))
    bpy.context.view_layer.update()
    read = read_mesh(obj, transform=np.array(obj.matrix_world, np.float64))
    assert np.array_equal(read.vertices, arrays(obj)[0] + (1, 2, 3))


def test_a_scale_of_zero_is_refused() -> None:
    obj = add_cube()
    obj.scale.z = 0
    bpy.context.view_layer.update()
    with pytest.raises(MeshError, match="scale of zero"):
        read_mesh(obj)


def test_another_kind_of_object_is_refused() -> None:
    bpy.ops.curve.primitive_bezier_circle_add()
    with pytest.raises(MeshError, match="convert it first"):
        read_mesh(bpy.context.object)


def test_an_empty_mesh_gives_empty_arrays() -> None:
    read = read_mesh(add_mesh("Nothing", [], []))
    assert read.vertices.shape == read.triangles.shape == (0, 3)
    assert read.left_behind == ()


def test_loose_points_and_edges_alone_give_no_triangles() -> None:
    read = read_mesh(add_mesh("Loose", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1)]))
    assert read.triangles.shape == (0, 3)
    assert read.left_behind == ()


def test_nothing_is_left_behind() -> None:
    obj = add_cube()
    mesh = obj.data
    obj.vertex_groups.new(name="Arm")
    obj.shape_key_add(name="Basis")
    mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    mesh.attributes.new("Wear", "FLOAT", "POINT")
    mesh.edges[0].use_edge_sharp = True
    mesh.normals_split_custom_set([(0, 0, 1)] * 24)
    read = read_mesh(obj, apply_modifiers=False, carry=True)
    assert read.left_behind == ()
    assert {"UVMap", "Paint", "Wear", "sharp_edge", NORMALS, GROUPS, KEYS} <= set(
        read.carried["attributes"])


def test_shape_keys_that_modifiers_make_unequal_are_named() -> None:
    obj = add_cube()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Flat", from_mix=False)
    for point in key.points:
        point.co.z = 0
    obj.modifiers.new("Merge", "WELD").merge_threshold = 0.1
    read = read_mesh(obj, carry=True)
    assert read.keys is None
    assert "Flat" in read.left_behind[0]


def test_shape_keys_go_through_modifiers() -> None:
    obj = add_cube()
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Up", from_mix=False).points[0].co.z += 1
    obj.modifiers.new("Other side", "MIRROR")
    read = read_mesh(obj, carry=True)
    assert read.keys is not None
    assert read.keys.offsets.shape == (2, len(read.vertices), 3)
    assert np.count_nonzero(read.keys.offsets[1]) == 2
    assert not obj.show_only_shape_key


@pytest.mark.parametrize("applied", [True, False])
def test_a_key_is_read_whole_whatever_mutes_it(applied: bool) -> None:
    obj = add_cube()
    obj.vertex_groups.new(name="Half").add(range(8), 0.5, "REPLACE")
    obj.shape_key_add(name="Basis")
    for name in ("Muted", "Grouped", "Plain"):
        obj.shape_key_add(name=name, from_mix=False).points[0].co.z += 1
    keys = obj.data.shape_keys.key_blocks
    keys["Muted"].mute, keys["Grouped"].vertex_group = True, "Half"
    if applied:
        obj.modifiers.new("Cut", "TRIANGULATE")
    read = read_mesh(obj, carry=True)
    assert read.keys is not None
    assert np.abs(read.keys.offsets).max(axis=(1, 2)) == pytest.approx([0, 1, 1, 1])
    assert [(key.mute, key.vertex_group) for key in keys] == [(False, ""), (True, ""), (False, "Half"), (False, "")]
