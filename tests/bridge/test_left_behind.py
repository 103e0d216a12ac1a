# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh loses is named; what it does not lose is not."""

import bpy
import pytest

from eso_addon.bridge.modifiers import live_modifiers
from eso_addon.bridge.read_mesh import read_mesh
from eso_addon.bridge.stream_objects import read_objects
from tests.bridge.blender_scenes import add_cube, add_sphere


def instancer(*, realize: bool) -> bpy.types.Object:
    """Add a ball with a cube on each point."""
    obj = add_sphere(subdivisions=2)
    tree = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, cube, place, join, real, end = (tree.nodes.new(kind) for kind in (
        "NodeGroupInput", "GeometryNodeMeshCube", "GeometryNodeInstanceOnPoints", "GeometryNodeJoinGeometry",
        "GeometryNodeRealizeInstances", "NodeGroupOutput"))
    tree.links.new(start.outputs[0], place.inputs["Points"])
    tree.links.new(cube.outputs["Mesh"], place.inputs["Instance"])
    for output in (start.outputs[0], place.outputs[0]):
        tree.links.new(output, join.inputs[0])
    tree.links.new(join.outputs[0], real.inputs[0])
    tree.links.new((real if realize else join).outputs[0], end.inputs[0])
    obj.modifiers.new("Cubes", "NODES").node_group = tree
    return obj


@pytest.mark.parametrize("realize", [True, False])
def test_instances_of_geometry_nodes(realize: bool) -> None:
    obj = instancer(realize=realize)
    lost = read_mesh(obj, carry=True).left_behind
    assert lost == (() if realize else ("instances, which Realize Instances would make part of the mesh (Cubes)",))
    assert read_objects([obj])[0][0].left_behind == list(lost)
    assert read_mesh(obj, carry=True, apply_modifiers=False).left_behind == ()


def test_instances_of_others_are_theirs() -> None:
    instancer(realize=False)
    obj = instancer(realize=True)
    assert read_mesh(obj, carry=True).left_behind == ()


def test_modifiers_that_are_off() -> None:
    obj = add_cube()
    for name, kind in (("Smooth", "SUBSURF"), ("Bones", "ARMATURE"), ("Cloth", "CLOTH"), ("Thick", "SOLIDIFY")):
        obj.modifiers.new(name, kind).show_viewport = name == "Thick"
    live = live_modifiers(obj, {"ARMATURE"})
    assert read_mesh(obj, carry=True, live=live).left_behind == ("modifiers that are off in the viewport (Smooth)",)
    assert read_mesh(obj, carry=True, live=["Smooth", *live]).left_behind == ()
    assert read_mesh(obj, carry=True, live=live, apply_modifiers=False).left_behind == ()


def test_modifiers_of_streams() -> None:
    obj = add_cube()
    obj.modifiers.new("Thick", "SOLIDIFY")
    assert read_objects([obj])[0][0].left_behind == []
    assert read_objects([obj], apply_modifiers=False)[0][0].left_behind == ["modifiers (Thick)"]
    obj.modifiers["Thick"].show_viewport = False
    assert read_objects([obj])[0][0].left_behind == ["modifiers that are off in the viewport (Thick)"]


def test_what_was_sculpted_goes_unless_it_is_applied() -> None:
    obj = add_cube()
    obj.modifiers.new("Levels", "MULTIRES")
    assert read_mesh(obj, carry=True, apply_modifiers=False).left_behind == ()
    bpy.ops.object.multires_subdivide(modifier="Levels")
    assert read_mesh(obj, carry=True).left_behind == ()
    assert read_mesh(obj, carry=True, apply_modifiers=False).left_behind == ("what was sculpted on levels (Levels)",)


def test_a_modifier_that_was_bound() -> None:
    target = add_sphere("Target")
    obj = add_sphere("Ball")
    obj.modifiers.new("Follow", "SURFACE_DEFORM").target = target
    bpy.ops.object.surfacedeform_bind(modifier="Follow")
    assert obj.modifiers["Follow"].is_bound
    assert read_mesh(obj, carry=True).left_behind == ()
    lost = read_mesh(obj, carry=True, apply_modifiers=False).left_behind
    assert lost == ("the binding of modifiers (Follow)",)
