# SPDX-License-Identifier: GPL-3.0-or-later
"""What is shown over the scene, as arrays; how it looks is seen in a window."""

import bpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon import vertex_weights
from eso_addon.operators import shown
from eso_addon.operators.colors import ramp
from eso_addon.operators.deviation_show import divided
from tests.bridge.blender_scenes import activate, add_cube, add_mesh, add_sphere, addon, arrays, empty_file

__all__ = ["addon", "empty_file"]

pytestmark = pytest.mark.usefixtures("addon")


def test_weights_are_those_of_the_api_and_are_kept() -> None:
    obj = add_sphere()
    assert bpy.ops.object.eso_weights_show(rings=2) == {"FINISHED"}
    kept = np.zeros(len(obj.data.vertices), np.float32)
    obj.data.attributes["eso_weight"].data.foreach_get("value", kept)
    np.testing.assert_array_equal(kept, vertex_weights(*arrays(obj), rings=2).astype(np.float32))
    assert shown.is_shown("weights", obj)
    assert shown.shown().colors.shape == (len(kept), 4)


def test_edges_of_a_cube_are_sharp() -> None:
    obj = add_cube()
    bpy.ops.object.eso_edges_show()
    lines = {label: ends for label, _, ends in shown.shown().lines}
    assert len(lines["Sharp edges"]) == 12
    obj.scale = (2, 1, 1)  # lines are in the object's space
    assert np.abs(lines["Sharp edges"]).max() == 1


def test_a_copy_deviates_by_nothing_and_a_level_by_something() -> None:
    add_sphere()
    bpy.ops.object.eso_simplify(ratio=0.1)
    assert bpy.ops.object.eso_deviation_show() == {"FINISHED"}
    overlay = shown.shown()
    assert float(overlay.high) > 0
    assert len(overlay.colors) == len(overlay.vertices)
    assert overlay.faces.max() < len(overlay.vertices)


@pytest.mark.parametrize("name", ["eso_weights_show", "eso_edges_show", "eso_deviation_show"])
@pytest.mark.parametrize("in_edit_mode", [True, False])
def test_a_mesh_without_faces_is_refused(name: str, in_edit_mode: bool) -> None:
    other = add_cube()
    obj = add_mesh("Points", [(0, 0, 0), (1, 0, 0)], [], [(0, 1)])
    obj.modifiers.new("Cut", "TRIANGULATE")
    activate(obj, other)
    if in_edit_mode and name != "eso_deviation_show":
        bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="has no faces: there is nothing to show"):
        getattr(bpy.ops.object, name)()
    assert shown.shown() is None


def test_it_can_be_hidden_and_goes_with_the_file() -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="Nothing is shown"):
        bpy.ops.object.eso_overlay_hide()
    bpy.ops.object.eso_weights_show()
    bpy.ops.object.eso_overlay_hide()
    assert shown.shown() is None
    bpy.ops.object.eso_weights_show()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert shown.shown() is None


@settings(max_examples=30)
@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_divided_triangles_cover_the_same_surface(sides: int, seed: int) -> None:
    vertices = np.random.default_rng(seed).normal(size=(7, 3))
    triangles = np.array([[0, 1, 2], [2, 3, 4], [6, 5, 0]])
    points, faces = divided(vertices, triangles, sides)
    assert len(faces) == 3 * sides**2
    whole = np.cross(vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
                     vertices[triangles[:, 2]] - vertices[triangles[:, 0]])  # fmt: skip
    parts = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    np.testing.assert_allclose(parts.reshape(3, -1, 3), np.repeat(whole[:, None], sides**2, 1) / sides**2, atol=1e-9)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1), st.floats(-1e3, 1e3), st.floats(0, 1e3))
def test_colours_are_colours(values: list[float], low: float, span: float) -> None:
    colors = ramp(np.array(values), low, low + span)
    assert colors.shape == (len(values), 4)
    assert ((colors >= 0) & (colors <= 1)).all()
