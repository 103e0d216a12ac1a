# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams of other writers in Blender: whatever their attributes are called, a valid mesh comes of them."""

from typing import Any

import bpy
import numpy as np
import pytest

from eso_addon.bridge.stream_mesh import write_stream_mesh
from eso_addon.bridge.stream_objects import add_objects
from eso_addon.progressive.progressive import progressive
from eso_addon.progressive.scene import Scene, scene_from_bytes
from tests.progressive.meshes import grid, spoil


def test_odd_attributes_do_no_harm() -> None:
    points, faces = grid(5, 5, np.random.default_rng(0), closed=False)
    side = np.ones(faces.shape)
    named: dict[str, Any] = {
        "vertex": {"position": points + 1, "twice": np.arange(25.0), "sharp_face": np.ones(25, bool)},
        "corner": {"twice": side, ".corner_vert": side.astype(np.int32), ".normals": np.zeros((*faces.shape, 3), "<f4"),
                   "custom_normal": side, "wide": np.zeros((*faces.shape, 9))},
        "face": {"material_index": np.full(len(faces), -5, np.int16), "big": np.full(len(faces), 2**40)},
        "side": {".edge_verts": side.astype(np.int32), "uv_seam": side, ".diagonal": side > 0, ".first": side > 0},
    }
    whole = progressive(points, faces, attributes=named, base_faces=4, meta={"types": 3, "groups": {}, "uv": 7})
    for level in (whole.restore(), whole.at(faces=9)):
        mesh = write_stream_mesh(level, whole.meta, "odd")
        assert len(mesh.polygons) == len(level.faces)
        assert not mesh.validate()
        assert {polygon.material_index for polygon in mesh.polygons} == {0}
        positions = np.zeros(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", positions)
        assert positions.tobytes() == level.vertices.tobytes()


@pytest.mark.parametrize("kind", ["soup", "flipped", "repeated", "fins", "pinched", "loose"])
def test_meshes_that_blender_would_not_make(kind: str) -> None:
    points, faces = spoil(*grid(6, 6, np.random.default_rng(1), closed=True), np.random.default_rng(2), kind)
    written = Scene([progressive(points, faces, base_faces=4)], {"materials": [1], "objects": []})
    scene = scene_from_bytes(written.to_bytes())
    for level in (scene.levels(), scene.levels(faces=len(faces) // 2)):
        obj = add_objects(scene, level, bpy.context.scene.collection)[0]
        assert len(obj.data.vertices) == len(level[0].vertices)
        if kind not in ("repeated", "fins"):  # which Blender drops
            assert len(obj.data.polygons) == len(level[0].faces)


@pytest.mark.parametrize("entry", [
    {"name": 3, "relative": "x", "frame": float("nan"), "slider_min": "low", "value": None, "mute": "yes",
     "vertex_group": 7, "interpolation": "KEY_MAGIC"},
    {"name": "Far", "relative": 99, "frame": -1e300, "slider_max": 1e300, "value": [1], "interpolation": 0}, {}, 5])
def test_odd_shape_keys_do_no_harm(entry: object) -> None:
    points, faces = grid(5, 5, np.random.default_rng(0), closed=False)
    named = {"vertex": {f".key.{number}": (points + number).astype(np.float32) for number in range(2)}}
    meta = {"keys": [entry, {"name": "Up"}], "keys_timing": {"eval_time": "noon", "use_relative": []},
            "groups": ["A", 3], "groups_locked": ["x", True, False]}
    scene = Scene([progressive(points, faces, attributes=named, base_faces=4, meta=meta)], {})
    obj = add_objects(scene, scene.levels(), bpy.context.scene.collection)[0]
    assert [group.lock_weight for group in obj.vertex_groups] == [False, True]
    assert (obj.data.shape_keys is None) == (entry == 5)
    if entry != 5:
        assert [len(key.points) for key in obj.data.shape_keys.key_blocks] == [25, 25]
        assert obj.data.shape_keys.key_blocks[1].name == "Up"
