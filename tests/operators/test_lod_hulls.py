# SPDX-License-Identifier: GPL-3.0-or-later
"""Collision hulls: convex, around the finest level, named for the engine, made again in place."""

import bpy
import numpy as np
import pytest

from eso_addon.bridge.hulls import MOST_CORNERS, convex_hull
from eso_addon.core.mesh import MeshError
from tests.bridge.blender_scenes import activate, add_cube, add_empty, add_mesh, add_sphere, arrays

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate
add = bpy.ops.object.eso_lod_hulls


def hulls() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if "eso_hull" in obj]


def planes(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    points, faces = arrays(obj)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals, np.einsum("fi,fi->f", normals, corners[:, 0])


@pytest.mark.parametrize(("profile", "name"), [
    ("unreal", "UCX_Ball_LOD0_01"), ("secondlife", "Ball_PHYS"), ("godot", "Ball_Hull_01-convcolonly")])
def test_a_hull_is_convex_and_has_few_corners(profile: str, name: str) -> None:
    obj = add_sphere()
    obj.location, obj.scale = (1, 2, 3), (2, 1, 1)
    generate(ratios="0.5, 0.1", profile=profile)
    add()
    (hull,) = hulls()
    assert hull.name == hull.data.name == name
    normals, offsets = planes(hull)
    points, _ = arrays(hull)
    assert len(points) <= MOST_CORNERS
    assert (points @ normals.T <= offsets + 1e-4).all()  # and its faces look outward
    bpy.context.view_layer.update()
    assert hull.matrix_world == obj.matrix_world
    volume = offsets.sum() / 6
    assert 0.9 * 4 / 3 * np.pi < volume < 4 / 3 * np.pi


def test_a_hull_for_each_part_of_many() -> None:
    for x in (0, 5, 10):
        add_cube(f"Box{x}").location.x = x
    activate(*bpy.data.objects)
    bpy.ops.object.join()
    bpy.context.object.name = "Shelf"
    generate(ratios="1", profile="unreal")
    add(kind="parts")
    assert [hull.name for hull in hulls()] == [f"UCX_Shelf_LOD0_{number:02}" for number in (1, 2, 3)]
    assert all(len(hull.data.vertices) == 8 for hull in hulls())
    add(kind="one")
    assert [hull.name for hull in hulls()] == ["UCX_Shelf_LOD0_01"]


def test_hulls_are_made_again_in_place() -> None:
    add_sphere()
    generate(ratios="0.5", profile="unreal")
    add()
    add()
    assert [hull.name for hull in hulls()] == ["UCX_Ball_LOD0_01"]
    assert [hull.data.name for hull in hulls()] == ["UCX_Ball_LOD0_01"]


def test_flat_things_and_engines_without_hulls_are_refused() -> None:
    add_mesh("Flat", [(x, y, 0) for x in range(3) for y in range(3)],
             [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)])
    generate(ratios="1", profile="unreal")
    with pytest.raises(RuntimeError, match="would be flat"):
        add()
    assert not hulls()
    generate(ratios="1", profile="unity")
    with pytest.raises(RuntimeError, match="Unity has no names"):
        add()


def test_a_hull_stands_where_constraints_put_its_source() -> None:
    obj, target = add_sphere(subdivisions=3), add_empty("Target")
    target.location.x = 5
    obj.constraints.new("COPY_LOCATION").target = target
    activate(obj)
    generate(ratios="0.5", profile="unreal")
    activate(obj)
    add()
    for x in (5, 7):
        target.location.x = x
        bpy.context.view_layer.update()
        assert [round(thing.matrix_world.translation.x, 5) for thing in (obj, *hulls())] == [x, x]


def test_a_flat_hull_leaves_no_mesh_behind() -> None:
    with pytest.raises(MeshError, match="flat"):
        convex_hull(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], np.float32), "Flat")
    assert not bpy.data.meshes
