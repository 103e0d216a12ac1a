# SPDX-License-Identifier: GPL-3.0-or-later
import random
from pathlib import Path

import bpy
import numpy as np
import pytest

from eso_addon.bridge.read_mesh import read_mesh
from eso_addon.core.simplify import simplify
from tests.bridge.blender_scenes import activate, add_cube, add_mesh, add_sphere, add_twin, arrays, linked_from_library

pytestmark = pytest.mark.usefixtures("addon")
simplify_active = bpy.ops.object.eso_simplify

OPTIONS = [
    {"ratio": 0.3},
    {"faces_target": 100, "method": "qem"},
    {"max_error": 0.02, "method": "so", "refit": False},
    {"ratio": 0.2, "rings": 2, "placement": "endpoint"},
    {"ratio": 0.1, "preset": "paper"},
]


@pytest.mark.parametrize("options", OPTIONS)
def test_operator_and_api_give_equal_arrays(options: dict) -> None:
    obj = add_sphere()
    vertices, triangles = arrays(obj)
    carried = read_mesh(obj, carry=True).carried
    target = {"faces_target": "count", "max_error": "error"}.get(next(iter(options)), "ratio")
    assert simplify_active(target=target, **options) == {"FINISHED"}
    wanted = simplify(vertices, triangles, **_as_single_precision(options), **carried)
    new = bpy.context.object
    got_vertices, got_triangles = arrays(new)
    assert np.array_equal(got_vertices, wanted.vertices.astype(np.float32))
    assert np.array_equal(got_triangles, wanted.faces)
    uv = np.array([loop.uv for loop in new.data.uv_layers["UVMap"].data])
    assert np.array_equal(uv, wanted.attributes["UVMap"].reshape(-1, 2))
    assert new["eso_triangles"] == len(wanted.faces)
    assert new["eso_error"] == wanted.error
    assert not new.data.validate()


def _as_single_precision(options: dict) -> dict:
    """Blender's properties hold floats in single precision."""
    return {name: float(np.float32(value)) if isinstance(value, float) else value for name, value in options.items()}


def test_the_result_stands_beside_the_untouched_source() -> None:
    obj = add_sphere()
    before = arrays(obj)
    simplify_active(ratio=0.25)
    new = bpy.context.object
    assert (new.name, new["eso_source"]) == ("Ball_ESO", "Ball")
    assert bpy.context.selected_objects == [new]
    assert new.users_collection == obj.users_collection
    assert all(np.array_equal(a, b) for a, b in zip(before, arrays(obj), strict=True))


def test_in_place() -> None:
    obj = add_sphere()
    count = len(obj.data.polygons)
    simplify_active(ratio=0.25, in_place=True)
    assert bpy.context.object == obj
    assert len(obj.data.polygons) < count / 2
    assert obj.data.name == "Ball"
    assert len(bpy.data.objects) == len(bpy.data.meshes) == 1


@pytest.mark.parametrize("all_users", [True, False])
def test_in_place_on_a_shared_mesh(all_users: bool) -> None:
    obj = add_sphere()
    other = bpy.data.objects.new("Other", obj.data)
    simplify_active(ratio=0.25, in_place=True, all_users=all_users)
    assert (other.data == obj.data) == all_users


def test_in_place_for_all_users_takes_the_modifiers_of_all() -> None:
    obj = add_sphere(subdivisions=3)
    other = add_twin(obj, "Other")
    for user in (obj, other):
        user.modifiers.new("Row", "ARRAY").count = 2
    simplify_active(ratio=0.5, in_place=True, all_users=True)
    bpy.context.view_layer.update()
    assert other.data == obj.data
    assert [user.dimensions.x for user in (obj, other)] == pytest.approx([4, 4], rel=0.05)


def test_in_place_for_all_users_needs_the_same_modifiers() -> None:
    obj = add_sphere(subdivisions=3)
    other = add_twin(obj, "Other")
    obj.modifiers.new("Row", "ARRAY").count = 2
    mesh = obj.data
    with pytest.raises(RuntimeError, match="'Other' shows the mesh through other modifiers than 'Ball'"):
        simplify_active(ratio=0.5, in_place=True, all_users=True)
    assert mesh == obj.data == other.data
    simplify_active(ratio=0.5, in_place=True, all_users=True, apply_modifiers=False)
    assert obj.data == other.data != mesh
    assert len(obj.modifiers) == 1


def test_an_error_target_is_in_the_scenes_units() -> None:
    """A ball of ten times the size, allowed ten times the error, gets the same triangles."""
    counts = []
    for scale, error in ((1, 0.01), (10, 0.1)):
        obj = add_sphere()
        obj.scale = (scale,) * 3
        bpy.context.view_layer.update()
        simplify_active(target="error", max_error=error)
        counts.append(len(bpy.context.object.data.polygons))
    assert counts[0] == pytest.approx(counts[1], rel=0.02)


def test_modifiers_are_applied_and_gone_or_kept() -> None:
    obj = add_cube()
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 3
    simplify_active(ratio=0.5)
    assert len(bpy.context.object.modifiers) == 0
    assert bpy.context.object["eso_triangles"] > 12
    activate(obj)
    simplify_active(ratio=0.5, apply_modifiers=False)
    assert len(bpy.context.object.modifiers) == 1
    assert bpy.context.object["eso_triangles"] <= 12


@pytest.mark.parametrize("in_place", [True, False])
def test_edit_mode_is_left_with_its_current_state_simplified(in_place: bool) -> None:
    obj = add_sphere(subdivisions=3)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    assert simplify_active(ratio=0.5, in_place=in_place) == {"FINISHED"}
    new = bpy.context.object
    assert new.mode == obj.mode == "OBJECT"
    assert (new == obj) == in_place
    assert len(new.data.polygons) == pytest.approx(320 * 4 / 2, abs=2)


def test_material_slots_and_indices_are_kept() -> None:
    obj = add_sphere()
    for name in ("Red", "Blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = int(polygon.center.z > 0)
    simplify_active(ratio=0.3)
    mesh = bpy.context.object.data
    assert [material.name for material in mesh.materials] == ["Red", "Blue"]
    high = [p for p in mesh.polygons if abs(p.center.z) > 0.5]
    assert high
    assert all(polygon.material_index == int(polygon.center.z > 0) for polygon in high)


def test_what_is_not_carried_is_reported() -> None:
    obj = add_cube()
    obj.shape_key_add(name="Basis")
    for point in obj.shape_key_add(name="Flat", from_mix=False).points:
        point.co.z = 0
    obj.modifiers.new("Merge", "WELD").merge_threshold = 0.1
    simplify_active(ratio=0.5)
    assert "Not carried: shape keys (Basis, Flat)" in bpy.context.window_manager.eso_last_run.lines


def test_the_report_has_counts_error_and_seconds() -> None:
    add_sphere()
    simplify_active(ratio=0.3)
    last_run = bpy.context.window_manager.eso_last_run
    assert last_run.title == "Simplified Ball"
    after = bpy.context.object["eso_triangles"]
    assert f"1,280 to {after:,} triangles" in last_run.lines
    assert "error" in last_run.lines
    assert " s" in last_run.lines


@pytest.mark.parametrize("hide", ["hide_set", "hide_viewport", "hide_select", "lock"])
def test_a_hidden_or_locked_object_works(hide: str) -> None:
    obj = add_sphere()
    if hide == "hide_set":
        obj.hide_set(True)
    elif hide == "lock":
        obj.lock_location = obj.lock_rotation = obj.lock_scale = (True,) * 3
    else:
        setattr(obj, hide, True)
    with bpy.context.temp_override(active_object=obj, object=obj, selected_objects=[obj]):
        assert simplify_active(ratio=0.3) == {"FINISHED"}
    assert "Ball_ESO" in bpy.data.objects


def link_ball(tmp_path: Path) -> bpy.types.Object:
    add_sphere("Far")
    obj = linked_from_library(tmp_path, "objects", "Far")
    bpy.context.scene.collection.objects.link(obj)
    activate(obj)
    return obj


def test_linked_data_gives_a_local_object(tmp_path: Path) -> None:
    obj = link_ball(tmp_path)
    assert simplify_active(ratio=0.3) == {"FINISHED"}
    new = bpy.context.object
    assert new != obj
    assert new.library is None
    assert new.data.library is None


def test_linked_data_is_refused_in_place(tmp_path: Path) -> None:
    link_ball(tmp_path)
    with pytest.raises(RuntimeError, match="make it local first"):
        simplify_active(ratio=0.3, in_place=True)


def test_no_active_object() -> None:
    with pytest.raises(RuntimeError, match="No active object: select a mesh"):
        simplify_active()


def test_another_kind_of_object() -> None:
    bpy.ops.object.light_add()
    with pytest.raises(RuntimeError, match="convert it first"):
        simplify_active()


def test_another_mode() -> None:
    add_sphere()
    bpy.ops.object.mode_set(mode="SCULPT")
    with pytest.raises(RuntimeError, match="Switch to Object Mode"):
        simplify_active()


@pytest.mark.parametrize("edges", [[], [(0, 1)]])
def test_no_faces(edges: list) -> None:
    add_mesh("Loose", [(0, 0, 0), (1, 0, 0)], [], edges)
    with pytest.raises(RuntimeError, match="has no faces"):
        simplify_active()


def test_no_faces_left_in_edit_mode() -> None:
    add_cube()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.delete(type="ONLY_FACE")
    _works_or_is_refused(ratio=0.5)


@pytest.mark.parametrize("ratio", [0.0, -1.0, 1.5])
def test_a_ratio_out_of_range_is_refused(ratio: float) -> None:
    add_sphere()
    with pytest.raises(RuntimeError, match="[Rr]atio"):
        simplify_active(ratio=ratio)
    assert len(bpy.data.objects) == 1


def test_a_count_above_the_inputs_works_or_is_refused() -> None:
    add_sphere()
    _works_or_is_refused(target="count", faces_target=10**6)


ODD = {
    "one triangle": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
    "no area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 3)]),
    "bow-tie": ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], [(0, 1, 2), (0, 3, 4)]),
    "three faces on an edge": (
        [(0, 0, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, 0, 0)],
        [(0, 1, 2), (0, 1, 3), (0, 1, 4)],
    ),
    "not a number": ([(0, 0, 0), (1, 0, 0), (0, 1, float("nan")), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)]),
    "infinite": ([(0, 0, 0), (1, 0, 0), (0, 1, float("inf")), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)]),
    "huge": ([(0, 0, 0), (1e12, 0, 0), (0, 1e12, 0), (1e12, 1e12, 1e11)], [(0, 1, 2), (1, 3, 2)]),
    "tiny": ([(0, 0, 0), (1e-12, 0, 0), (0, 1e-12, 0), (1e-12, 1e-12, 1e-13)], [(0, 1, 2), (1, 3, 2)]),
}


@pytest.mark.parametrize("kind", ODD)
def test_odd_meshes_work_or_are_refused(kind: str) -> None:
    add_mesh("Odd", *ODD[kind])
    _works_or_is_refused(ratio=0.5)


def test_a_moebius_strip_works_or_is_refused() -> None:
    angle = np.linspace(0, np.pi, 60, endpoint=False)
    across = np.stack([np.cos(2 * angle) * np.cos(angle), np.sin(2 * angle) * np.cos(angle), np.sin(angle)], axis=1)
    middle = np.stack([np.cos(2 * angle), np.sin(2 * angle), 0 * angle], axis=1)
    points = np.stack([middle - across / 4, middle + across / 4], axis=1).reshape(-1, 3)
    quads = [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(59)] + [(118, 119, 0, 1)]
    add_mesh("Strip", points.tolist(), quads)
    _works_or_is_refused(ratio=0.5)


def test_any_soup_works_or_is_refused() -> None:
    random.seed(0)
    points = [(random.random(), random.random(), random.random()) for _ in range(12)]
    add_mesh("Soup", points, [tuple(random.sample(range(12), 3)) for _ in range(60)])
    _works_or_is_refused(ratio=0.3)


def _works_or_is_refused(**options: object) -> None:
    """Either a valid mesh or one line that is no traceback, and then nothing new."""
    before = len(bpy.data.objects)
    count = len(read_mesh(bpy.context.object).triangles)
    try:
        simplify_active(**options)
    except RuntimeError as error:
        lines = str(error).strip().splitlines()
        assert len(lines) == 1
        assert "Traceback" not in lines[0]
        assert len(bpy.data.objects) == before
    else:
        assert len(bpy.context.object.data.polygons) <= count
        assert not bpy.context.object.data.validate()
