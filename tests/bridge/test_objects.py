# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import bpy
import pytest

from eso_addon.bridge import objects
from eso_addon.core.mesh import MeshError
from tests.bridge.blender_scenes import add_cube, add_sphere, linked_from_library


def new_mesh() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("New")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    return mesh


def test_triangles_are_counted_with_and_without_modifiers() -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 1
    assert objects.triangle_count(obj) == 12
    assert objects.triangle_count(obj, bpy.context.evaluated_depsgraph_get()) == 48


def test_a_new_object_stands_where_its_source_stands() -> None:
    obj = add_cube()
    obj.parent = add_sphere("Parent")
    obj.location = (1, 2, 3)
    obj.modifiers.new("Subdivide", "SUBSURF")
    obj.hide_select = True
    collection = bpy.context.scene.collection
    new = objects.add_object(obj, new_mesh(), "New", [collection], modifiers_applied=True, properties={"a": 1})
    bpy.context.view_layer.update()
    assert new.parent == obj.parent
    assert new.matrix_world == obj.matrix_world
    assert (len(new.modifiers), len(obj.modifiers)) == (0, 1)
    assert new["a"] == 1
    assert not new.hide_select


def test_in_place_gives_a_shared_mesh_to_one_object_unless_asked() -> None:
    obj = add_cube()
    other = bpy.data.objects.new("Other", obj.data)
    old = obj.data
    objects.replace_mesh(obj, new_mesh(), modifiers_applied=True)
    assert other.data == old
    assert obj.data != old
    new = new_mesh()
    objects.replace_mesh(other, new, modifiers_applied=True, all_users=True)
    assert other.data == new


def test_in_place_for_all_users() -> None:
    obj = add_cube()
    other = bpy.data.objects.new("Other", obj.data)
    objects.replace_mesh(obj, new_mesh(), modifiers_applied=True, all_users=True)
    assert other.data == obj.data
    assert len(obj.data.polygons) == 1
    assert obj.data.name == "Box"
    assert len(bpy.data.meshes) == 1


@pytest.mark.parametrize("local_object", [True, False])
def test_linked_data_is_not_replaced(tmp_path: Path, local_object: bool) -> None:
    add_cube("Far")
    obj = linked_from_library(tmp_path, "objects", "Far")
    if local_object:
        obj = bpy.data.objects.new("Near", obj.data)
    mesh = new_mesh()
    with pytest.raises(MeshError, match="make it local first"):
        objects.replace_mesh(obj, mesh, modifiers_applied=True)


def test_the_result_of_a_library_override_is_local(tmp_path: Path) -> None:
    collection = objects.level_collection("Far", bpy.context.scene)
    collection.objects.link(add_cube())
    linked = linked_from_library(tmp_path, "collections", "Far")
    scene = bpy.context.scene
    linked.override_hierarchy_create(scene, bpy.context.view_layer, do_fully_editable=True)
    source = next(obj for obj in bpy.data.objects if obj.override_library is not None)
    mesh = new_mesh()
    new = objects.add_object(source, mesh, "New", [scene.collection], modifiers_applied=True, properties={})
    assert new.override_library is None
    assert new.data == mesh
    with pytest.raises(MeshError, match="make it local first"):
        objects.replace_mesh(source, mesh, modifiers_applied=True)


def test_the_source_is_found_by_name_until_it_is_gone() -> None:
    obj, level = add_cube(), add_sphere()
    assert objects.source_of(level) is None
    level[objects.SOURCE] = obj.name
    assert objects.source_of(level) == obj
    bpy.data.objects.remove(obj)
    assert objects.source_of(level) is None


def test_a_collection_of_levels_is_found_again() -> None:
    scene = bpy.context.scene
    first = objects.level_collection("Levels", scene)
    assert objects.level_collection("Levels", scene) == first
    scene.collection.children.unlink(first)
    assert objects.level_collection("Levels", scene) == first
    assert first.name in scene.collection.children


def test_a_linked_collection_takes_no_new_objects(tmp_path: Path) -> None:
    collection = objects.level_collection("Far", bpy.context.scene)
    collection.objects.link(add_cube())
    linked = linked_from_library(tmp_path, "collections", "Far")
    scene = bpy.context.scene
    scene.collection.children.link(linked)
    assert objects.collections_for(linked.objects[0], scene) == [scene.collection]
    with pytest.raises(MeshError, match="choose another name"):
        objects.level_collection("Far", scene)
