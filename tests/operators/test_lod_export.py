# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels in files: names, order and layout as engines want them, and a scene that is as it was afterwards."""

import json
import shutil
import struct
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.bridge.blender_scenes import activate, add_cube, add_sphere
from tests.bridge.fbx import children_of, read_fbx, types_of

pytestmark = pytest.mark.usefixtures("addon")
generate = bpy.ops.object.eso_lod_generate
export = bpy.ops.object.eso_lod_export


def gltf_of(path: Path) -> dict:
    if path.suffix == ".gltf":
        return json.loads(path.read_text())
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def two_balls(profile: str, ratios: str = "0.5, 0.25, 0.1") -> None:
    """Make levels of a painted ball, and of a rigged one that hangs on it."""
    ball, other = add_sphere("Ball", 3), add_sphere("Other", 2)
    material = bpy.data.materials.new("Paint")
    for obj in (ball, other):
        obj.data.materials.append(material)
    other.parent, other.location, other.scale = ball, (3, 0, 0), (1, 2, 1)
    bpy.context.view_layer.update()
    activate(ball, other)
    generate(ratios=ratios, profile=profile)
    activate(ball, other)


def rigged(profile: str) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Make levels of a ball that a bone lifts."""
    ball = add_sphere("Ball", 3)
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.update()
    activate(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones.new("Bone")
    bone.tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    ball.parent = rig
    ball.modifiers.new("Rig", "ARMATURE").object = rig
    ball.vertex_groups.new(name="Bone").add(range(len(ball.data.vertices)), 1.0, "REPLACE")
    activate(ball)
    generate(ratios="0.5, 0.25", profile=profile)
    activate(ball)
    return ball, rig


def snapshot() -> dict:
    bpy.context.view_layer.update()
    return {
        "scenes": [scene.name for scene in bpy.data.scenes],
        "scene": bpy.context.scene.name,
        "objects": {
            o.name: (o.data and o.data.name, o.parent and o.parent.name, o.parent_type,
                     [c.name for c in o.users_collection],
                     np.round(o.matrix_world, 5).tolist(), o.hide_viewport, o.get("eso_profile"), o.select_get())
            for o in bpy.context.scene.objects
        },
        "all": sorted(o.name for o in bpy.data.objects),
        "addons": list(bpy.context.preferences.addons.keys()),
    }


@pytest.mark.parametrize("profile", ["plain", "unity", "unreal", "godot", "gltf", "secondlife"])
@pytest.mark.parametrize("ending", [".fbx", ".glb", ".gltf", ".obj", ".blend"])
def test_the_scene_is_as_it_was(tmp_path: Path, profile: str, ending: str) -> None:
    two_balls(profile, "0.5, 0.2")
    before = snapshot()
    assert export(filepath=str(tmp_path / f"levels{ending}")) == {"FINISHED"}
    assert snapshot() == before
    assert (tmp_path / f"levels{ending}").stat().st_size > 1000


def test_unreal_has_its_levels_below_a_group_in_order(tmp_path: Path) -> None:
    two_balls("unreal", ".9,.8,.7,.6,.5,.4,.3,.2")
    bpy.ops.object.eso_lod_hulls()
    export(filepath=str(tmp_path / "levels.fbx"))
    root = read_fbx(tmp_path / "levels.fbx")
    tree = children_of(root)
    assert tree["Ball"] == [f"Ball_LOD{number}" for number in range(8)]
    assert tree["Other"] == [f"Other_LOD{number}" for number in range(8)]
    assert sorted(tree[""]) == ["Ball", "Other", "UCX_Ball_LOD0_01", "UCX_Other_LOD0_01"]
    assert types_of(root)["Ball"] == types_of(root)["Other"] == "LodGroup"


def test_unity_has_siblings_in_order(tmp_path: Path) -> None:
    two_balls("unity")
    export(filepath=str(tmp_path / "levels.fbx"))
    names = [f"{base}_LOD{number}" for base in ("Ball", "Other") for number in range(3)]
    assert children_of(read_fbx(tmp_path / "levels.fbx")) == {"": names}


@pytest.mark.parametrize(("profile", "ending"), [("unreal", ".fbx"), ("unity", ".fbx"), ("godot", ".glb")])
def test_levels_are_posed_by_their_armature(tmp_path: Path, profile: str, ending: str) -> None:
    rigged(profile)
    export(filepath=str(tmp_path / f"levels{ending}"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if ending == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(tmp_path / "levels.fbx"))
    else:
        bpy.ops.import_scene.gltf(filepath=str(tmp_path / "levels.glb"))
    rig = next(obj for obj in bpy.data.objects if obj.type == "ARMATURE")
    for name in ("Ball_LOD0", "Ball_LOD1"):
        obj = bpy.data.objects[name]
        low = _lowest(obj)
        rig.pose.bones["Bone"].location.y += 3
        assert _lowest(obj) == pytest.approx(low + 3, abs=1e-3)
        rig.pose.bones["Bone"].location.y -= 3


def _lowest(obj: bpy.types.Object) -> float:
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return min((evaluated.matrix_world @ vertex.co).z for vertex in evaluated.data.vertices)


@pytest.mark.parametrize("ending", [".glb", ".gltf"])
def test_gltf_shows_the_finest_and_names_the_others(tmp_path: Path, ending: str) -> None:
    two_balls("gltf")
    path = tmp_path / f"levels{ending}"
    export(filepath=str(path))
    file = gltf_of(path)
    assert file["extensionsUsed"] == ["MSFT_lod"]
    assert "MSFT_lod" not in file.get("extensionsRequired", [])
    shown = [file["nodes"][index] for index in file["scenes"][file["scene"]]["nodes"]]
    assert sorted(node["name"] for node in shown) == ["Ball_LOD0", "Other_LOD0"]
    for node in shown:
        others = [file["nodes"][index] for index in node["extensions"]["MSFT_lod"]["ids"]]
        assert [other["name"] for other in others] == [node["name"].replace("0", digit) for digit in "12"]
        assert [file["meshes"][other["mesh"]] for other in others]
        coverage = node["extras"]["MSFT_screencoverage"]
        assert len(coverage) == 3
        assert 1 >= coverage[0] > coverage[1] > coverage[2] == 0
    everything = {index for node in file["nodes"] for index in node.get("children", [])}
    assert not everything & {index for node in shown for index in node["extensions"]["MSFT_lod"]["ids"]}


def test_blenders_own_export_writes_levels_for_gltf(tmp_path: Path) -> None:
    from eso_addon.bridge.gltf_lod import hooked

    two_balls("gltf")
    with hooked():
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / "own.glb"))
    file = gltf_of(tmp_path / "own.glb")
    lods = [node["name"] for node in file["nodes"] if "MSFT_lod" in node.get("extensions", {})]
    assert sorted(lods) == ["Ball_LOD0", "Other_LOD0"]


def test_levels_for_other_engines_stay_plain_nodes(tmp_path: Path) -> None:
    two_balls("godot")
    export(filepath=str(tmp_path / "levels.glb"))
    file = gltf_of(tmp_path / "levels.glb")
    assert "extensionsUsed" not in file
    names = [file["nodes"][index]["name"] for index in file["scenes"][0]["nodes"]]
    assert names == [f"{base}_LOD{number}" for base in ("Ball", "Other") for number in range(3)]


@pytest.mark.parametrize("rig", [False, True])
def test_the_khronos_validator_finds_no_error(tmp_path: Path, root: Path, rig: bool) -> None:
    if shutil.which("node") is None or not (root / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("needs node, and `npm install gltf-validator` in the project's folder")
    rigged("gltf") if rig else two_balls("gltf")
    export(filepath=str(tmp_path / "levels.glb"))
    script = ("const v=require('gltf-validator'),fs=require('fs');"
              "v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))"
              ".then(r=>console.log(JSON.stringify(r.issues)))")
    run = subprocess.run(["node", "-e", script, str(tmp_path / "levels.glb")], cwd=root, capture_output=True, text=True,
                         check=True)
    assert json.loads(run.stdout)["numErrors"] == 0, run.stdout


def test_second_life_names(tmp_path: Path) -> None:
    two_balls("secondlife", "0.8, 0.5, 0.3, 0.1")
    bpy.ops.object.eso_lod_hulls(kind="parts")
    export(filepath=str(tmp_path / "levels.glb"))
    file = gltf_of(tmp_path / "levels.glb")
    names = {node["name"] for node in file["nodes"]}
    assert names == {f"{base}{suffix}" for base in ("Ball", "Other")
                     for suffix in ("", "_LOD2", "_LOD1", "_LOD0", "_PHYS")}


def test_live_modifiers_are_in_the_file(tmp_path: Path) -> None:
    obj = add_sphere("Ball", 2)
    obj.modifiers.new("Half", "MIRROR")
    generate(ratios="0.5", live_mirror=True)
    level = bpy.data.objects["Ball_LOD0"]
    assert len(level.data.polygons) == 40
    export(filepath=str(tmp_path / "levels.glb"))
    file = gltf_of(tmp_path / "levels.glb")
    accessor = file["meshes"][0]["primitives"][0]["indices"]
    assert file["accessors"][accessor]["count"] == 2 * 40 * 3


def test_a_profile_other_than_that_of_the_levels(tmp_path: Path) -> None:
    two_balls("plain", "0.5, 0.25")
    export(filepath=str(tmp_path / "levels.fbx"), profile="unreal")
    assert children_of(read_fbx(tmp_path / "levels.fbx"))["Ball"] == ["Ball_LOD0", "Ball_LOD1"]


def test_without_an_ending_the_file_has_the_engines_own(tmp_path: Path) -> None:
    two_balls("unity")
    export(filepath=str(tmp_path / "levels"))
    assert (tmp_path / "levels.fbx").exists()


def test_stale_levels_are_written_with_a_warning(tmp_path: Path) -> None:
    two_balls("unity", "0.5")
    bpy.data.objects["Ball"].data.vertices[0].co.x += 1
    export(filepath=str(tmp_path / "levels.fbx"))
    assert "Edited since: Ball" in bpy.context.window_manager.eso_last_run.lines


@pytest.mark.parametrize(("options", "words"), [
    ({"filepath": ""}, "no file is named"),
    ({"filepath": "levels.stl"}, "no format that holds levels"),
    ({"filepath": "nowhere/levels.glb"}, "does not exist"),
    ({"filepath": "levels.glb", "profile": "secondlife"}, "at most 4 levels"),
])
def test_bad_requests_write_nothing(tmp_path: Path, options: dict, words: str) -> None:
    two_balls("plain", ".9,.8,.7,.6,.5")
    if options["filepath"]:
        options = {**options, "filepath": str(tmp_path / options["filepath"])}
    before = snapshot()
    with pytest.raises(RuntimeError, match=f"(?i){words}"):
        export(**options)
    assert snapshot() == before
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("which", ["ALL", "SELECTED"])
def test_levels_whose_source_is_gone(tmp_path: Path, which: str) -> None:
    two_balls("unreal", "0.5, 0.2")
    bpy.ops.object.eso_lod_hulls()
    for name in ("Ball", "Other"):
        bpy.data.objects.remove(bpy.data.objects[name])
    activate(bpy.data.objects["Ball_LOD1"])
    bpy.ops.object.eso_lod_hulls()  # around the finest, since nothing else is left
    export(filepath=str(tmp_path / "levels.fbx"), which=which)
    tree = children_of(read_fbx(tmp_path / "levels.fbx"))
    wanted = ["Ball", "Other"] if which == "ALL" else ["Ball"]
    for name in wanted:
        assert tree[name] == [f"{name}_LOD0", f"{name}_LOD1"]
    assert sorted(tree[""]) == [*wanted, *(f"UCX_{name}_LOD0_01" for name in wanted)]


def test_levels_that_an_instance_shows(tmp_path: Path) -> None:
    two_balls("godot", "0.5")
    empty = bpy.data.objects.new("Here", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Ball_LODs"]
    bpy.context.scene.collection.objects.link(empty)
    activate(empty)
    export(filepath=str(tmp_path / "levels.glb"))
    assert [node["name"] for node in gltf_of(tmp_path / "levels.glb")["nodes"]] == ["Ball_LOD0"]


def test_no_levels() -> None:
    two_balls("plain", "0.5")
    activate(add_cube())
    with pytest.raises(RuntimeError, match="None of the selected objects has levels"):
        export(filepath="levels.glb")
