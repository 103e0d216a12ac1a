# SPDX-License-Identifier: GPL-3.0-or-later
"""Normal maps of coarser levels."""

import bpy
import numpy as np
import pytest

from tests.bridge.blender_scenes import activate, add_mesh, add_sphere

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate
bake = bpy.ops.object.eso_lod_bake


def dented_ball() -> bpy.types.Object:
    """Make a smooth ball with dents, its UVs in another tile."""
    obj = add_sphere(subdivisions=4)
    for vertex in obj.data.vertices:
        vertex.co *= 1 + 0.05 * np.sin(12 * vertex.co.x) * np.sin(9 * vertex.co.y)
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    for corner in obj.data.uv_layers[0].uv:
        corner.vector.y += 1
    obj.data.materials.append(bpy.data.materials.new("Paint"))
    return obj


def test_dents_are_baked_and_used() -> None:
    obj = dented_ball()
    generate(ratios="1, 0.05", profile="unity")
    fine, coarse = bpy.data.objects["Ball_LOD0"], bpy.data.objects["Ball_LOD1"]
    uv = [tuple(corner.vector) for corner in coarse.data.uv_layers[0].uv]
    activate(obj)
    for _ in range(2):  # the second time in place
        assert bake(size=64, samples=1) == {"FINISHED"}
        image = bpy.data.images["Ball_LOD1_Normals"]
        assert len([i for i in bpy.data.images if i.name.startswith("Ball")]) == 1
        pixels = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
        assert pixels.std(axis=0)[:2].min() > 0.01
        lengths = np.linalg.norm(2 * pixels - 1, axis=1)
        assert abs(lengths.mean() - 1) < 0.05
        assert image.packed_file is not None
        (material,) = coarse.data.materials
        assert [m.name for m in fine.data.materials] == ["Paint"]
        assert material.name == "Paint_Ball_LOD1"
        shader = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
        assert shader.inputs["Normal"].links[0].from_node.bl_idname == "ShaderNodeNormalMap"
    assert [tuple(corner.vector) for corner in coarse.data.uv_layers[0].uv] == uv
    assert len(bpy.data.materials) == 2
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]


def test_what_cannot_be_baked_is_refused() -> None:
    add_mesh("Bare", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    generate(ratios="1", profile="unity")
    with pytest.raises(RuntimeError, match="coarser levels"):
        bake()
    with pytest.raises(RuntimeError, match="no UV map"):
        bake(detail="source")
    activate(add_sphere())
    generate(ratios="1, 0.5", profile="secondlife")
    with pytest.raises(RuntimeError, match="Second Life takes no normal map"):
        bake()
    assert not [image for image in bpy.data.images if image.name.endswith("_Normals")]
