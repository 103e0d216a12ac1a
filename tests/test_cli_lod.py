# SPDX-License-Identifier: GPL-3.0-or-later
"""The word `lod`: levels of every kind, in files as each engine wants them."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from eso_addon.cli import main
from eso_addon.files.off import write_off
from tests.bridge.blender_scenes import add_sphere
from tests.bridge.fbx import children_of, read_fbx, types_of
from tests.core.shapes import ball, noisy

bpy = pytest.importorskip("bpy")


def run(*words: object) -> int:
    return main([str(word) for word in words])


def figures(path: Path) -> list[dict]:
    return json.loads(path.read_text())["meshes"]


def gltf_of(path: Path) -> dict:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


@pytest.fixture
def rock(tmp_path: Path) -> Path:
    write_off(tmp_path / "rock.off", *noisy(ball(3), np.random.default_rng(0), 0.02))
    return tmp_path / "rock.off"


@pytest.fixture
def village(tmp_path: Path) -> Path:
    """Make a file of a painted ball, another that shares its mesh, and a skinned one, with names of several kinds."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    vertices, faces = ball(3)
    for number, name in enumerate(("Säule.001", "Säule.002", "Wächter")):
        if name != "Säule.002":
            mesh = bpy.data.meshes.new(name)
            mesh.from_pydata(vertices, (), faces.tolist())
            uv = mesh.uv_layers.new(name="Karte").uv
            for corner, loop in zip(uv, mesh.loops, strict=True):
                corner.vector = vertices[loop.vertex_index][:2] * 0.5 + 0.5
            mesh.materials.append(bpy.data.materials.new(f"Stein {number}"))
        obj = bpy.data.objects.new(name, mesh)
        obj.location.x = 3 * number
        scene.collection.objects.link(obj)
    rig = bpy.data.objects.new("Gerüst", bpy.data.armatures.new("Gerüst"))
    scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones.new("Knochen").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.parent = rig
    obj.modifiers.new("Gerüst", "ARMATURE").object = rig
    obj.vertex_groups.new(name="Knochen").add(range(len(mesh.vertices)), 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "village.blend"), copy=True)
    return tmp_path / "village.blend"


def read(path: Path) -> dict[str, "bpy.types.Object"]:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if path.suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    elif path.suffix == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
    bone_shapes = {bone.custom_shape for obj in bpy.data.objects if obj.pose for bone in obj.pose.bones}
    return {obj.name: obj for obj in bpy.data.objects if obj.type == "MESH" and obj not in bone_shapes}


@pytest.mark.parametrize(("profile", "ending", "suffixes"), [
    ("unity", ".fbx", ("_LOD0", "_LOD1")), ("unreal", ".fbx", ("_LOD0", "_LOD1")),
    ("godot", ".glb", ("_LOD0", "_LOD1")), ("gltf", ".glb", ("_LOD0", "_LOD1")),
    ("secondlife", ".glb", ("", "_LOD2")), ("plain", ".blend", ("_LOD0", "_LOD1"))])
def test_every_profile_on_several_objects(village: Path, tmp_path: Path, profile: str, ending: str,
                                          suffixes: tuple[str, str]) -> None:
    out = tmp_path / f"levels{ending}"
    assert run("lod", village, out, "--ratios", "0.5,0.25", "--profile", profile) == 0
    found = read(out)
    assert set(found) == {f"{base}{suffix}" for base in ("Säule.001", "Säule.002", "Wächter") for suffix in suffixes}
    for name, obj in found.items():
        assert len(obj.data.polygons) == (128 if name.endswith(suffixes[1]) else 256)
        assert len(obj.data.uv_layers) == 1
        assert [material.name[:5] for material in obj.data.materials] == ["Stein"]
        is_rigged = name.startswith("Wächter")
        assert [m.type for m in obj.modifiers] == (["ARMATURE"] if is_rigged else [])
        if is_rigged:
            assert obj.modifiers[0].object.name == "Gerüst"
            assert [group.name for group in obj.vertex_groups] == ["Knochen"]
    if ending != ".fbx":  # whose importer does not tell instances
        assert found[f"Säule.001{suffixes[1]}"].data == found[f"Säule.002{suffixes[1]}"].data
    assert found[f"Säule.002{suffixes[0]}"].matrix_world.translation.x == pytest.approx(3, abs=1e-5)


def test_unreal_groups_its_levels_in_order(rock: Path, tmp_path: Path) -> None:
    out = tmp_path / "rock.fbx"
    ratios = "0.9,0.8,0.7,0.6,0.5,0.4,0.3,0.2"
    assert run("lod", rock, out, "--ratios", ratios, "--profile", "unreal", "--hulls", "one") == 0
    tree = children_of(read_fbx(out))
    assert tree["rock"] == [f"rock_LOD{number}" for number in range(8)]
    assert sorted(tree[""]) == ["UCX_rock_LOD0_01", "rock"]
    assert types_of(read_fbx(out))["rock"] == "LodGroup"


def test_gltf_opens_as_the_finest(rock: Path, tmp_path: Path) -> None:
    out = tmp_path / "rock.glb"
    assert run("lod", rock, out, "--ratios", "0.5,0.25,0.1", "--profile", "gltf", "--json", tmp_path / "f.json") == 0
    file = gltf_of(out)
    assert len(file["scenes"]) == 1
    (shown,) = file["scenes"][0]["nodes"]
    node = file["nodes"][shown]
    assert node["name"] == "rock_LOD0"
    others = [file["nodes"][index]["name"] for index in node["extensions"]["MSFT_lod"]["ids"]]
    assert others == ["rock_LOD1", "rock_LOD2"]
    coverage = node["extras"]["MSFT_screencoverage"]
    assert coverage == sorted(coverage, reverse=True)
    assert len(coverage) == 3
    distances = [mesh["switch_distance"] for mesh in figures(tmp_path / "f.json")]
    assert distances == sorted(distances)


def test_sizes_on_screen(rock: Path, tmp_path: Path) -> None:
    picture = ("--pixels", "2", "--resolution", "1000", "--lens", "36")
    assert run("lod", rock, tmp_path / "rock.glb", "--sizes", "400,50", *picture, "--json", tmp_path / "f.json") == 0
    fine, coarse = figures(tmp_path / "f.json")
    extent = float(np.ptp(noisy(ball(3), np.random.default_rng(0), 0.02)[0], axis=0).max())
    assert fine["switch_distance"] == pytest.approx(extent * 1000 / 400, rel=1e-4)
    assert coarse["switch_distance"] == pytest.approx(extent * 1000 / 50, rel=1e-4)
    for level in (fine, coarse):
        assert level["error"] * 1000 / level["switch_distance"] <= 2


def test_a_count_is_for_all_together(village: Path, tmp_path: Path) -> None:
    assert run("lod", village, tmp_path / "out.glb", "--faces", "1000,500", "--json", tmp_path / "f.json") == 0
    levels = figures(tmp_path / "f.json")
    for number, total in enumerate((1000, 500)):
        counts = {mesh["name"]: mesh["triangles_after"] for mesh in levels if mesh["level"] == number}
        assert set(counts) == {"Säule.001", "Wächter"}
        drawn = 2 * counts["Säule.001"] + counts["Wächter"]  # the first is there twice
        assert total - 4 <= drawn <= total


def test_levels_say_how_they_were_made(rock: Path, tmp_path: Path) -> None:
    assert run("lod", rock, tmp_path / "rock.blend", "--ratios", "0.5", "--profile", "unity", "--method", "qem") == 0
    level = read(tmp_path / "rock.blend")["rock_LOD0"]
    assert (level["eso_source"], level["eso_level"], level["eso_triangles"]) == ("rock", 0, 256)
    assert level["eso_profile"] == "unity"
    assert json.loads(level["eso_settings"])["engine"] == {"method": "qem"}
    assert [c.name for c in level.users_collection] == ["rock_LODs"]


@pytest.mark.parametrize(("words", "message"), [
    (("--ratios", "0.5,0.5"), "is there twice"),
    (("--ratios", "0.9,0.8,0.7,0.6,0.5", "--profile", "secondlife"), "at most 4 levels"),
    (("--ratios", ".9,.8,.7,.6,.5,.4,.3,.2,.1", "--profile", "unreal"), "at most 8 levels"),
    (("--ratios", "0.5", "--profile", "unity", "--hulls", "one"), "no names for collision hulls"),
    (("--sizes", "100", "--lens", "0"), "lens"),
    (("--sizes", "100", "--pixels", "0"), "pixels"),
])
def test_bad_requests_are_one_line(rock: Path, tmp_path: Path, words: tuple[str, ...], message: str,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    assert run("lod", rock, tmp_path / "out.glb", *words) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["rock.off"]


def test_two_levels_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    vertices, faces = ball(1)
    for name in ("Tree", "Tree_LOD2"):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices, (), faces.tolist())
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"), copy=True)
    words = ("--ratios", "0.9,0.6", "--profile", "secondlife")
    assert run("lod", tmp_path / "in.blend", tmp_path / "out.glb", *words) == 1
    assert "two objects would be named 'Tree_LOD2'" in capsys.readouterr().err
    assert not (tmp_path / "out.glb").exists()


def test_instances_of_collections_share_their_levels(tmp_path: Path) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    vertices, faces = ball(2)
    mesh = bpy.data.meshes.new("Baum")
    mesh.from_pydata(vertices, (), faces.tolist())
    wood = bpy.data.collections.new("Wald")
    wood.objects.link(bpy.data.objects.new("Baum", mesh))
    for number in range(3):
        empty = bpy.data.objects.new(f"Hier {number}", None)
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", wood, 4 * number
        bpy.context.scene.collection.objects.link(empty)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wald.blend"), copy=True)
    assert run("lod", tmp_path / "wald.blend", tmp_path / "wald.glb", "--ratios", "0.5", "--json", tmp_path / "f") == 0
    assert len(figures(tmp_path / "f")) == 1
    file = gltf_of(tmp_path / "wald.glb")
    levels = [node for node in file["nodes"] if "mesh" in node]
    assert len(levels) == 3
    assert len(file["meshes"]) == 1


@pytest.mark.parametrize("kind", ["objects", "meshes", "collections", "instance", "overrides"])
def test_what_a_file_links_is_worked_on(kind: str, tmp_path: Path) -> None:
    """In the file that is written nothing is linked any more, and the other file is as it was."""
    library, source, target = (tmp_path / f"{name}.blend" for name in ("library", "source", "target"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    obj = add_sphere("Far", 3)
    obj.modifiers.new("Thick", "SOLIDIFY")
    bpy.context.scene.collection.objects.unlink(obj)
    group = bpy.data.collections.new("Things")
    bpy.context.scene.collection.children.link(group)
    group.objects.link(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    before = library.read_bytes()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    link(library, kind)
    add_sphere("Own", 3)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    count = 160 if kind == "meshes" else 320
    for words in (["simplify", "--ratio", "0.5"], ["lod", "--ratios", "0.5"]):
        report = tmp_path / "figures.json"
        assert run(words[0], source, target, *words[1:], "--json", report) == 0
        assert {mesh["triangles_after"] for mesh in figures(report)} == {160, count}
        made = [thing for thing in read(target).values() if thing.name in bpy.context.scene.objects]
        assert not any(thing.library or thing.data.library for thing in made)
        assert sum(len(thing.data.polygons) for thing in made) == 160 + count
    assert library.read_bytes() == before


def test_a_library_that_is_not_there_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    library, source = tmp_path / "library.blend", tmp_path / "source.blend"
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add_sphere("Far", 3)
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    link(library, "objects")
    add_sphere("Own", 3)
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    library.unlink()
    for words in (["simplify", source, tmp_path / "out.glb", "--ratio", "0.5"],
                  ["stream", source, tmp_path / "out.esopm"]):
        capsys.readouterr()
        assert run(*words) == 0
        told = capsys.readouterr()
        assert "files that are not there (library.blend)" in told.out + told.err


def link(library: Path, kind: str) -> None:
    """Link the ball of a library in one of the ways that there are."""
    scene = bpy.context.scene
    names = {"objects": "Far", "meshes": "Far"}
    with bpy.data.libraries.load(str(library), link=True) as (_, ours):
        setattr(ours, kind if kind in names else "collections", [names.get(kind, "Things")])
    if kind == "objects":
        scene.collection.objects.link(bpy.data.objects["Far"])
    elif kind == "meshes":
        scene.collection.objects.link(bpy.data.objects.new("Near", bpy.data.meshes["Far"]))
    elif kind == "instance":
        empty = bpy.data.objects.new("Here", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Things"]
        scene.collection.objects.link(empty)
    else:
        scene.collection.children.link(bpy.data.collections["Things"])
        if kind == "overrides":
            group = bpy.data.collections["Things"]
            group.override_hierarchy_create(scene, bpy.context.view_layer)
            scene.collection.children.unlink(group)


@pytest.mark.parametrize("profile", ["unity", "secondlife"])
def test_levels_in_a_blend_file_can_be_exported_from_there(village: Path, tmp_path: Path, profile: str) -> None:
    from eso_addon import operators, settings

    assert run("lod", village, tmp_path / "levels.blend", "--ratios", "0.5,0.2", "--profile", profile) == 0
    names = set(read(tmp_path / "levels.blend"))
    for part in (settings, operators):
        part.register()
    try:
        bpy.ops.object.eso_lod_export(filepath=str(tmp_path / "again.glb"), which="ALL")
    finally:
        for part in (operators, settings):
            part.unregister()
    last = {"unity": "_LOD0", "secondlife": ""}[profile]
    assert len(names) == 6
    found = set(read(tmp_path / "again.glb"))
    assert {name for name in found if name.startswith("S")} == {f"Säule.00{n}{suffix}" for n in (1, 2) for suffix in (
        last, "_LOD1" if profile == "unity" else "_LOD2")}


def test_a_hull_stands_where_its_source_stood(tmp_path: Path) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(location=(5, 0, 0))
    parent = bpy.context.object
    bpy.ops.mesh.primitive_ico_sphere_add(location=(0, 3, 0))
    bpy.context.object.parent = parent
    bpy.context.object.name = "Child"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"), copy=True)
    words = ("--ratios", "0.5", "--profile", "unreal", "--hulls", "one")
    assert run("lod", tmp_path / "in.blend", tmp_path / "out.blend", *words) == 0
    hull = read(tmp_path / "out.blend")["UCX_Child_LOD0_01"]
    bpy.context.view_layer.update()
    assert tuple(hull.matrix_world.translation) == pytest.approx((5, 3, 0))
