# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams out of Blender and back: the same meshes, at any level, in one step."""

from pathlib import Path

import bmesh
import bpy
import numpy as np
import pytest

from eso_addon.bridge.attributes import ATTRIBUTE_TYPES, read_attribute
from eso_addon.bridge.nodes import use_nodes
from tests.bridge.blender_scenes import activate, add_cube, add_mesh, add_sphere

from .test_carrying import check_joined, joined_by_nodes

pytestmark = pytest.mark.usefixtures("addon")
# what Blender makes anew, and what is of the editors
_PASSING = (".corner_edge", ".edge_verts", ".select_", ".hide_", ".uv_select_")


def paint(material: bpy.types.Material, color: tuple) -> None:
    material.diffuse_color = color
    use_nodes(material).nodes["Principled BSDF"].inputs["Base Color"].default_value = color


def rich_monkey() -> bpy.types.Object:
    """Add a mesh that has a bit of everything."""
    bpy.ops.mesh.primitive_monkey_add()
    obj, rng = bpy.context.object, np.random.default_rng(0)
    mesh = obj.data
    for name in ("Red", "Blue"):
        mesh.materials.append(bpy.data.materials.new(name))
    paint(bpy.data.materials["Red"], (1, 0.25, 0, 1))
    mesh.polygons.foreach_set("material_index", (np.arange(len(mesh.polygons)) > 200).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", rng.random(len(mesh.polygons)) < 0.5)
    mesh.uv_layers.new(name="Second").uv.foreach_set("vector", rng.random(2 * len(mesh.loops)).astype(np.float32))
    color = mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    color.data.foreach_set("color_srgb", (rng.integers(0, 256, 4 * len(mesh.loops)) / 255).astype(np.float32))
    color = mesh.color_attributes.new("Light", "FLOAT_COLOR", "POINT")
    color.data.foreach_set("color", rng.random(4 * len(mesh.vertices)).astype(np.float32))
    mesh.edges.foreach_set("use_seam", rng.random(len(mesh.edges)) < 0.1)
    mesh.edges.foreach_set("use_edge_sharp", rng.random(len(mesh.edges)) < 0.1)
    for name in ("crease_edge", "bevel_weight_edge"):
        values = rng.random(len(mesh.edges)) * (rng.random(len(mesh.edges)) < 0.1)
        mesh.attributes.new(name, "FLOAT", "EDGE").data.foreach_set("value", values.astype(np.float32))
    mesh.attributes.new("number", "INT", "POINT").data.foreach_set("value", np.arange(len(mesh.vertices)))
    obj.vertex_groups.new(name="Empty")
    group = obj.vertex_groups.new(name="Some")
    group.add([1, 2, 3], 0.5, "REPLACE")
    group.add([5], 0.0, "REPLACE")
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Up")
    key.value, key.slider_max = 0.25, 2.0
    for point in key.points:
        point.co.z += 1
    obj.location, obj.rotation_euler, obj.scale = (1, 2, 3), (0.1, 0.2, 0.3), (1, 2, 1)
    bpy.context.view_layer.update()
    return obj


def loose_cylinder() -> bpy.types.Object:
    """Add n-gons, custom normals, loose edges and points."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=13)
    obj = bpy.context.object
    work = bmesh.new()
    work.from_mesh(obj.data)
    ends = [work.verts.new((5, 5, z)) for z in range(3)]
    work.edges.new(ends[:2]).seam = True
    work.to_mesh(obj.data)
    work.free()
    obj.data.normals_split_custom_set([(0.6, 0, 0.8)] * len(obj.data.loops))
    return obj


def edge_values(mesh: bpy.types.Mesh, name: str) -> dict:
    values, ends = read_attribute(mesh, name), read_attribute(mesh, ".edge_verts")
    return {} if values is None else {tuple(sorted(pair)): value for pair, value in zip(ends.tolist(), values.tolist())}


def assert_same(one: bpy.types.Object, other: bpy.types.Object) -> None:
    """Compare all that two objects hold, in order."""
    a, b = one.data, other.data
    assert (len(a.vertices), len(a.edges), len(a.polygons)) == (len(b.vertices), len(b.edges), len(b.polygons))
    for attribute in a.attributes:
        if attribute.name.startswith(_PASSING) or attribute.data_type not in ATTRIBUTE_TYPES:
            continue
        if attribute.domain == "EDGE":
            assert edge_values(a, attribute.name) == edge_values(b, attribute.name)
        else:
            assert b.attributes[attribute.name].data_type == attribute.data_type
            assert np.array_equal(read_attribute(a, attribute.name), read_attribute(b, attribute.name)), attribute.name
    normals = [np.zeros(3 * len(mesh.loops), np.float32) for mesh in (a, b)]
    for mesh, values in zip((a, b), normals, strict=True):
        mesh.corner_normals.foreach_get("vector", values)
    assert np.array_equal(*normals)
    assert [m and m.name for m in a.materials] == [m and m.name for m in b.materials]
    assert [[(g.group, g.weight) for g in v.groups] for v in a.vertices] == [
        [(g.group, g.weight) for g in v.groups] for v in b.vertices]
    assert [g.name for g in one.vertex_groups] == [g.name for g in other.vertex_groups]
    # Blender takes a matrix apart into place, turn and scale
    assert np.allclose(one.matrix_world, other.matrix_world, atol=1e-6)


def exported(path: Path, **options: object) -> Path:
    assert bpy.ops.export_mesh.esopm(filepath=str(path), **options) == {"FINISHED"}
    return path


def imported(path: Path, **options: object) -> list[bpy.types.Object]:
    assert bpy.ops.import_mesh.esopm(filepath=str(path), **options) == {"FINISHED"}
    return sorted(bpy.context.selected_objects, key=lambda obj: obj.name)


def test_everything_comes_back_in_its_order(tmp_path: Path) -> None:
    objects = [rich_monkey(), loose_cylinder()]
    twin = objects[1].copy()
    bpy.context.collection.objects.link(twin)
    twin.location.x += 4
    bpy.context.view_layer.update()
    path = exported(tmp_path / "all.esopm", keep_order=True)
    found = imported(path)
    for number, obj in enumerate(objects):
        near = [new for new in found if (new.matrix_world.translation - obj.matrix_world.translation).length < 0.1]
        assert [new.eso_stream.mesh for new in near] == [number]
        assert_same(obj, near[0])
    assert len({new.data for new in found if new.eso_stream.mesh == 1}) == 1
    keys = next(new for new in found if new.eso_stream.mesh == 0).data.shape_keys
    assert [(key.name, key.value, key.slider_max) for key in keys.key_blocks][1] == ("Up", 0.25, 2.0)


def everything_set(keys: bpy.types.Key) -> list:
    """Give all that is set of shape keys."""
    return [keys.use_relative, keys.eval_time, *((
        key.name, key.frame, key.relative_key.name, key.interpolation, key.lock_shape, key.mute, key.slider_min,
        key.slider_max, key.value, key.vertex_group, [tuple(point.co) for point in key.points])
        for key in keys.key_blocks)]


@pytest.mark.parametrize("relative", [True, False])
def test_shape_keys_and_locks_come_back_as_they_are_set(relative: bool, tmp_path: Path) -> None:
    obj = add_cube()
    obj.vertex_groups.new(name="Open").add([1], 0.25, "REPLACE")
    obj.vertex_groups.new(name="Locked").lock_weight = True
    obj.shape_key_add(name="Basis")
    keys = obj.data.shape_keys
    keys.use_relative = relative
    for number in (1, 2, 3):
        keys.eval_time = 30.0 * number
        obj.shape_key_add(name=f"Key {number}", from_mix=False).points[number].co.z += number
    first, second, third = keys.key_blocks[1:]
    first.interpolation, first.lock_shape, first.vertex_group = "KEY_CARDINAL", True, "Open"
    second.mute, second.relative_key = True, first
    for key, least, most, value in ((second, -5.0, -2.0, -3.0), (third, 5.0, 9.0, 6.5)):
        key.slider_min, key.slider_max = -10.0, most
        key.slider_min, key.value = least, value
    keys.eval_time = 12.5
    path = exported(tmp_path / "keys.esopm", keep_order=True)
    new = imported(path)[0]
    assert everything_set(new.data.shape_keys) == everything_set(keys)
    assert [group.lock_weight for group in new.vertex_groups] == [False, True]
    new.eso_stream.percent = 1
    new.eso_stream.percent = 100
    assert everything_set(new.data.shape_keys) == everything_set(keys)


def test_animation_of_shape_keys_is_told(tmp_path: Path) -> None:
    obj = add_cube()
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Up").driver_add("value").driver.expression = "0.25"
    exported(tmp_path / "keys.esopm")
    assert "Not carried: animation and drivers of shape keys" in bpy.context.window_manager.eso_last_run.lines


def test_without_order_the_same_polygons(tmp_path: Path) -> None:
    obj = loose_cylinder()
    path = exported(tmp_path / "a.esopm")
    new = imported(path)[0]

    def polygons(mesh: bpy.types.Mesh) -> list:
        rounds = [[tuple(mesh.vertices[v].co) for v in p.vertices] for p in mesh.polygons]
        return sorted(min(tuple(r[k:] + r[:k]) for k in range(len(r))) for r in rounds)

    assert polygons(obj.data) == polygons(new.data)


def test_materials_come_by_name_and_colour(tmp_path: Path) -> None:
    rich_monkey()
    path = exported(tmp_path / "a.esopm")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    new = imported(path)[0]
    assert [m.name for m in new.data.materials] == ["Red", "Blue"]
    red = new.data.materials[0]
    shader = red.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value
    assert tuple(red.diffuse_color) == tuple(shader) == (1, 0.25, 0, 1)


def test_levels_and_the_slider(tmp_path: Path) -> None:
    add_sphere(subdivisions=5)
    path = exported(tmp_path / "ball.esopm")
    obj = imported(path, level="PERCENT", percent=10.0)[0]
    whole = 20 * 4**4
    assert whole * 0.098 <= len(obj.data.polygons) <= whole * 0.1
    obj.eso_stream.percent = 50
    assert whole * 0.49 <= len(obj.data.polygons) <= whole * 0.5
    obj.eso_stream.percent = 100
    assert len(obj.data.polygons) == whole
    assert not obj.eso_stream.trouble
    obj = imported(path, level="FACES", faces=300)[0]
    assert len(obj.data.polygons) <= 300
    path.unlink()
    obj.eso_stream.percent = 20
    assert "cannot be read" in obj.eso_stream.trouble
    assert len(obj.data.polygons) <= 300


def test_bits_and_selection(tmp_path: Path) -> None:
    add_cube("Left out")
    obj = add_sphere(subdivisions=4)
    activate(obj)
    small = exported(tmp_path / "s.esopm", quantise=True, bits=10, use_selection=True).stat().st_size
    assert small < exported(tmp_path / "l.esopm", use_selection=True).stat().st_size
    new = imported(tmp_path / "s.esopm")
    assert len(new) == 1
    reach = [np.abs(read_attribute(o.data, "position")).max() for o in (obj, new[0])]
    assert abs(reach[0] - reach[1]) < 2 / 1023


def test_modifiers_are_applied_or_not(tmp_path: Path) -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 1
    path = exported(tmp_path / "a.esopm")
    assert len(imported(path)[0].data.polygons) == 24
    activate(obj)
    path = exported(tmp_path / "b.esopm", apply_modifiers=False, use_selection=True)
    assert len(imported(path)[0].data.polygons) == 6


def test_groups_that_geometry_nodes_bring_keep_their_names(tmp_path: Path) -> None:
    joined_by_nodes()
    check_joined(imported(exported(tmp_path / "joined.esopm", use_selection=True))[0])


def test_bad_input_is_one_error(tmp_path: Path) -> None:
    assert not bpy.ops.export_mesh.esopm.poll()
    add_mesh("Points", [(0, 0, 0)], [])
    assert len(imported(exported(tmp_path / "p.esopm"))[0].data.vertices) == 1
    for data, words in ((b"ply", "not an .esopm"), (b"", "not an .esopm")):
        (tmp_path / "bad.esopm").write_bytes(data)
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.import_mesh.esopm(filepath=str(tmp_path / "bad.esopm"))
    with pytest.raises(RuntimeError, match="No such file"):
        bpy.ops.import_mesh.esopm(filepath=str(tmp_path / "missing.esopm"))
    whole = (tmp_path / "p.esopm").read_bytes()
    with pytest.raises(RuntimeError, match="cannot|No such|denied|Is a dir|not a dir|exist"):
        bpy.ops.export_mesh.esopm(filepath=str(tmp_path / "p.esopm" / "x.esopm"))
    assert (tmp_path / "p.esopm").read_bytes() == whole


def test_a_damaged_file_is_refused_after_it_was_read_in_part(tmp_path: Path) -> None:
    add_sphere(subdivisions=5)
    path = exported(tmp_path / "ball.esopm")
    whole = path.read_bytes()
    path.write_bytes(whole[:len(whole) // 2])
    for _ in range(2):
        with pytest.raises(RuntimeError, match="cut short"):
            bpy.ops.import_mesh.esopm(filepath=str(path))
        assert imported(path, partial=True)


@pytest.mark.filterwarnings("ignore:.*does not support blend relative")
def test_a_path_beside_the_blend_file(tmp_path: Path) -> None:
    add_cube()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert bpy.ops.export_mesh.esopm(filepath="//cube.esopm", web_page=True) == {"FINISHED"}
    assert {"cube.esopm", "cube.html", "scene.blend"} == {path.name for path in tmp_path.iterdir()}
    assert bpy.ops.import_mesh.esopm(filepath="//cube.esopm") == {"FINISHED"}


def test_the_page_is_not_written_over_the_stream(tmp_path: Path) -> None:
    add_cube()
    with pytest.raises(RuntimeError, match="give another"):
        bpy.ops.export_mesh.esopm(filepath=str(tmp_path / "cube.html"), web_page=True)
    for path in ("", str(tmp_path)):
        with pytest.raises(RuntimeError, match="Cannot write"):
            bpy.ops.export_mesh.esopm(filepath=path, web_page=True)
    assert not list(tmp_path.iterdir())


def test_nothing_selected_is_told(tmp_path: Path) -> None:
    add_cube()
    bpy.ops.object.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="no mesh object"):
        bpy.ops.export_mesh.esopm(filepath=str(tmp_path / "n.esopm"), use_selection=True)
    assert not (tmp_path / "n.esopm").exists()


def test_a_web_page_comes_with_the_stream(tmp_path: Path) -> None:
    activate(add_cube())
    assert bpy.ops.export_mesh.esopm(filepath=str(tmp_path / "cube.esopm"), web_page=True) == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cube.esopm", "cube.html"]
    assert (tmp_path / "cube.html").read_text(encoding="utf-8").startswith("<!doctype html>")
