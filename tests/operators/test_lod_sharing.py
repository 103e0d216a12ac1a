# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of one mesh share levels if they show the same, and only then; what they show makes levels stale."""

from collections.abc import Callable

import bpy
import pytest

from tests.bridge.blender_scenes import activate, add_empty, add_scaling_nodes, add_sphere, add_twin, set_scale

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate
update = bpy.ops.object.eso_lod_update
Objects = tuple[bpy.types.Object, bpy.types.Object]


def two_balls() -> Objects:
    one = add_sphere("One", 3)
    return one, add_twin(one, "Other")


def sizes(suffix: str = "_LOD0") -> list[float]:
    bpy.context.view_layer.update()
    return [bpy.data.objects[f"{name}{suffix}"].dimensions.x for name in ("One", "Other")]


def stale() -> list[bool]:
    return [bool(bpy.data.objects[f"{name}_LOD0"]["eso_stale"]) for name in ("One", "Other")]


def cut(one: bpy.types.Object, other: bpy.types.Object) -> None:
    cutter = add_sphere("Cutter", 2)
    cutter.location.x = 1
    for obj in (one, other):
        modifier = obj.modifiers.new("Cut", "BOOLEAN")
        modifier.object, modifier.operation = cutter, "DIFFERENCE"
    other.location.x = 10


def displace(one: bpy.types.Object, other: bpy.types.Object) -> None:
    texture = bpy.data.textures.new("Slope", "BLEND")
    for obj in (one, other):
        modifier = obj.modifiers.new("Displace", "DISPLACE")
        modifier.texture, modifier.texture_coords, modifier.mid_level = texture, "GLOBAL", 0
    other.location.x = 10


def scale(one: bpy.types.Object, other: bpy.types.Object) -> None:
    add_scaling_nodes(one, other)
    set_scale(other, 3.0)


@pytest.mark.parametrize("differ", [cut, displace, scale])
def test_what_shows_another_mesh_has_levels_of_its_own(differ: Callable[..., None]) -> None:
    one, other = two_balls()
    differ(one, other)
    bpy.context.view_layer.update()
    activate(one, other)
    generate(ratios="0.9")
    assert bpy.data.objects["One_LOD0"].data != bpy.data.objects["Other_LOD0"].data
    assert sizes() == pytest.approx(sizes(""), rel=0.02)
    assert abs(sizes()[0] - sizes()[1]) > 0.1


@pytest.mark.parametrize("kind", ["nodes", "mirror", "subdivision"])
def test_what_shows_the_same_shares_its_levels(kind: str) -> None:
    one, other = two_balls()
    other.location.x = 8
    if kind == "nodes":
        add_scaling_nodes(one, other)
        set_scale(one, 2.0)
        set_scale(other, 2.0)
    for obj in (one, other):
        if kind == "mirror":
            obj.modifiers.new("Mirror", "MIRROR").mirror_object = empty = add_empty(f"{obj.name} middle")
            empty.location.x = obj.location.x + 2
        elif kind == "subdivision":
            obj.modifiers.new("Subdivision", "SUBSURF")
    bpy.context.view_layer.update()
    activate(one, other)
    generate(ratios="0.5")
    assert sizes() == pytest.approx(sizes(""), rel=0.05)
    if kind != "mirror":  # whose middles are different objects
        assert bpy.data.objects["One_LOD0"].data == bpy.data.objects["Other_LOD0"].data


def test_inputs_of_nodes_make_levels_stale() -> None:
    one, other = two_balls()
    add_scaling_nodes(one, other)
    activate(one, other)
    generate(ratios="0.5")
    set_scale(other, 2.0)
    assert stale() == [False, True]
    update()
    assert stale() == [False, False]
    assert sizes() == pytest.approx([2, 4], rel=0.05)


def test_a_cutter_that_moves_makes_levels_stale_but_not_one_that_moves_along() -> None:
    one, other = two_balls()
    cut(one, other)
    bpy.context.view_layer.update()
    activate(one, other)
    generate(ratios="0.9")
    bpy.data.objects["Cutter"].location.x += 9.8
    bpy.context.view_layer.update()
    assert stale() == [True, True]
    update()
    assert sizes() == pytest.approx(sizes(""), rel=0.02)
    for obj in (one, other, bpy.data.objects["Cutter"]):
        obj.location.x += 0.7
    bpy.context.view_layer.update()
    assert stale() == [False, False]


def test_a_pose_makes_nothing_stale() -> None:
    one, other = two_balls()
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    for obj in (one, other):
        obj.modifiers.new("Rig", "ARMATURE").object = rig
    activate(one, other)
    generate(ratios="0.5")
    rig.location.x = 3
    bpy.context.view_layer.update()
    assert stale() == [False, False]
