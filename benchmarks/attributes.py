# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh carries, beside Blender's Decimate at the same triangle counts: `python -m benchmarks.attributes`."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from eso_addon.bridge.nodes import use_nodes
from eso_addon.bridge.read_mesh import MeshArrays, read_mesh
from eso_addon.bridge.scene_files import READERS
from eso_addon.bridge.write_mesh import write_mesh
from eso_addon.core.closest import ClosestPoints
from eso_addon.core.deviation import measure
from eso_addon.core.sampling import face_samples
from eso_addon.core.simplify import simplify

from .render import rendered_difference

NAMES = ("spot.obj", "bunny10k_textured.obj", "kip.obj", "face_4mat.obj", "lilith.obj", "gltf/DamagedHelmet.glb",
         "gltf/MaterialsVariantsShoe.glb", "gltf/Duck.glb", "gltf/chr_knight.glb", "gltf/CesiumMan.glb",
         "gltf/MorphStressTest.glb")
TEXTURES = {"spot.obj": "spot_texture.png", "bunny10k_textured.obj": "TextureDouble_A.png"}
SAMPLES = 20_000
Arrays = np.ndarray


def main(argv: Sequence[str] | None = None) -> None:
    """Print a table of figures for each model and ratio."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.attributes", description=__doc__)
    parser.add_argument("--models", type=Path, default=Path(os.environ.get("MODELS", ".")), help="folder of models")
    parser.add_argument("--names", default=",".join(NAMES), help="files in it, separated by commas")
    parser.add_argument("--ratios", default="0.5,0.2,0.05")
    parser.add_argument("--render", type=Path, help="render six views of each into this folder, and compare them")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="of the engine")
    args = parser.parse_args(argv)
    options = {name: _value(value) for name, _, value in (text.partition("=") for text in args.option)}
    every: list[str] = []
    for name in args.names.split(","):
        for ratio in map(float, args.ratios.split(",")):
            lines = compare(args.models / name, ratio, args.render, options)
            print("\n".join(lines), flush=True)
            every += lines
    print("\n".join(table(every)))


def table(lines: Sequence[str]) -> list[str]:
    """Return a table in Markdown: the figures of each mesh, from what `compare` says, as parts of Decimate's."""
    rows: dict[str, dict[str, str]] = {}
    for line in lines:
        if not line.startswith(" "):
            row = rows.setdefault(line.split(";")[0].split(" -> ")[0].rsplit(":", 1)[0], {})
            engine, bare = (float(text.split(" s")[0]) for text in line.split("engine ")[1].split(" (")[:2])
            row["time, of that without attributes"] = f"{engine / max(bare, 1e-3):.2f}"
        elif line.endswith("none"):
            row[line[4:32].strip()] = line.split()[-2]
        else:
            ours, theirs, part = line.split()[-3:]
            row[line[4:32].strip()] = f"{ours} of {theirs}" if "turned" in line else part
    titles = list(dict.fromkeys(title for row in rows.values() for title in row))
    cells = [["mesh, part of triangles", *titles]]
    cells += [[name, *(row.get(title, "") for title in titles)] for name, row in rows.items()]
    cells.insert(1, ["---"] * len(cells[0]))
    return [f"| {' | '.join(row)} |" for row in cells]


def _value(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


def compare(path: Path, ratio: float, pictures: Path | None, options: dict[str, Any]) -> list[str]:
    """Simplify every mesh of a file, by both, to the same counts; give lines of the table."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    READERS[path.suffix.lower()](path)
    _give_texture(path)
    lines, shown = [], []
    for obj in [obj for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.visible_get()]:
        for modifier in obj.modifiers:
            modifier.show_viewport = False
        bpy.context.view_layer.update()
        clock = [time.process_time()]  # of this process: others may be at work
        source = read_mesh(obj, carry=True, apply_modifiers=False)
        carried = source.carried
        clock.append(time.process_time())
        if len(source.triangles) < 100:
            continue
        plain = simplify(source.vertices, source.triangles, ratio=ratio)
        clock.append(time.process_time())
        result = simplify(source.vertices, source.triangles, ratio=ratio, **carried, **options)
        clock.append(time.process_time())
        ours = write_mesh(result, source, f"{obj.name} ours")
        clock.append(time.process_time())
        reading, bare, engine, writing = np.diff(clock)
        theirs = decimated(obj, len(result.faces))
        shown.append((obj, ours, theirs))
        lines.append(f"{path.name}:{obj.name} {ratio:g}: {len(source.triangles)} -> {len(result.faces)} of "
                     f"{round(ratio * len(source.triangles))}, Decimate {len(theirs.loop_triangles)}; "
                     f"read {reading:.3f} s, engine {engine:.2f} s ({bare:.2f} s without attributes), written "
                     f"{writing:.3f} s; error "
                     f"{result.error:.3g} against {plain.error:.3g} {' '.join(result.messages)}")
        for title, figure in FIGURES.items():
            one, other = figure(source, obj, ours), figure(source, obj, theirs)
            if one is not None and other is None:
                lines.append(f"    {title:28} {one:12.6g}         none")
            if one is not None and other is not None:
                lines.append(f"    {title:28} {one:12.6g} {other:12.6g}   {one / other if other else np.nan:8.3f}")
        posed = posed_deviation(obj, ours, theirs)
        if posed is not None:
            lines.append(f"    {'posed, mean distance':28} {posed[0]:12.6g} {posed[1]:12.6g}   "
                         f"{posed[0] / posed[1]:8.3f}")
    if pictures is not None and shown:
        for title, light in (("rendered, lit", "STUDIO"), ("rendered, texture alone", "FLAT")):
            one, other = rendered_difference(shown, pictures, f"{path.stem}_{ratio:g}_{light.lower()}", light)
            lines.append(f"    {title:28} {one:12.6g} {other:12.6g}   {one / max(other, 1e-12):8.3f}")
    return lines


def _give_texture(path: Path) -> None:
    """Put a texture on a model whose file names none."""
    if path.name in TEXTURES:
        material = bpy.data.materials.new("Texture")
        tree = use_nodes(material)
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(str(path.with_name(TEXTURES[path.name])))
        tree.links.new(node.outputs[0], tree.nodes["Principled BSDF"].inputs[0])
        for obj in bpy.context.scene.objects:
            if obj.type == "MESH":
                obj.data.materials.clear()
                obj.data.materials.append(material)


def decimated(obj: bpy.types.Object, triangles: int) -> bpy.types.Mesh:
    """Collapse with Blender's Decimate to at most so many triangles."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    copy.modifiers.clear()
    if copy.data.shape_keys:
        copy.shape_key_clear()
    modifier = copy.modifiers.new("Decimate", "DECIMATE")
    modifier.use_collapse_triangulate = True
    obj.data.calc_loop_triangles()
    modifier.ratio = triangles / max(len(obj.data.loop_triangles), 1)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(copy.evaluated_get(depsgraph), preserve_all_data_layers=True,
                                           depsgraph=depsgraph)
    bpy.data.objects.remove(copy)
    mesh.calc_loop_triangles()
    return mesh


class Surface:
    """Triangles of a mesh with values at their corners, in object space."""

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        mesh.calc_loop_triangles()
        self.points = np.zeros(len(mesh.vertices) * 3)
        mesh.vertices.foreach_get("co", self.points)
        self.points = self.points.reshape(-1, 3)
        self.corners = np.zeros(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("loops", self.corners)
        self.corners = self.corners.reshape(-1, 3)
        vertex = np.zeros(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertex)
        self.faces = vertex[self.corners].astype(np.int64)
        self.mesh = mesh

    def uv(self) -> Arrays | None:
        """Return the active UV map at the triangles' corners."""
        if self.mesh.uv_layers.active is None:
            return None
        values = np.zeros(len(self.mesh.loops) * 2)
        self.mesh.uv_layers.active.data.foreach_get("uv", values)
        return values.reshape(-1, 2)[self.corners]

    def normals(self) -> Arrays:
        """Return the normals at the triangles' corners."""
        values = np.zeros(len(self.mesh.loops) * 3)
        self.mesh.corner_normals.foreach_get("vector", values)
        return values.reshape(-1, 3)[self.corners]


def _nearest_values(source: Surface, values: Arrays, points: Arrays) -> Arrays:
    """Return values of a surface at the points nearest to others."""
    closest, face, _ = ClosestPoints(source.points, source.faces).query(points)
    return np.einsum("ij,ijk->ik", _weights(source, face, closest), values[face])


def _weights(surface: Surface, face: Arrays, points: Arrays) -> Arrays:
    a, b, c = surface.points[surface.faces[face]].transpose(1, 0, 2)
    matrix = np.stack((b - a, c - a), axis=-1)
    solved = np.einsum("ijk,ik->ij", np.linalg.pinv(matrix), points - a)
    return np.concatenate((1 - solved.sum(axis=1, keepdims=True), solved), axis=1)


def _samples(surface: Surface) -> tuple[Arrays, Arrays]:
    return face_samples(surface.points, surface.faces, SAMPLES, np.random.default_rng(0))[:2]


def uv_error(_: MeshArrays, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Return the mean distance in UV between samples and the nearest points of the original."""
    original, surface = Surface(obj.data), Surface(mesh)
    before, after = original.uv(), surface.uv()
    if before is None or after is None:
        return None
    points, face = _samples(surface)
    own = np.einsum("ij,ijk->ik", _weights(surface, face, points), after[face])
    return float(np.linalg.norm(own - _nearest_values(original, before, points), axis=1).mean())


def flipped(_: MeshArrays, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Count UV triangles turned the other way than the original is at the nearest point of their middle."""
    original, surface = Surface(obj.data), Surface(mesh)
    before, after = original.uv(), surface.uv()
    if before is None or after is None:
        return None
    middle = surface.points[surface.faces].mean(axis=1)
    face = ClosestPoints(original.points, original.faces).query(middle)[1]
    was, now = _area(before)[face], _area(after)
    return float(((was * now < 0) & (np.abs(now) > 1e-10)).sum())


def negative(_: MeshArrays, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Return how many more UV triangles of negative area there are than in the original."""
    before, after = Surface(obj.data).uv(), Surface(mesh).uv()
    if before is None or after is None:
        return None
    return float((_area(after) < -1e-10).sum()) - float((_area(before) < 0).sum()) * len(after) / len(before)


def _area(uv: Arrays) -> Arrays:
    one, other = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def normal_error(_: MeshArrays, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Return the mean angle, in degrees, between normals of samples and of the nearest points of the original."""
    original, surface = Surface(obj.data), Surface(mesh)
    points, face = _samples(surface)
    own = _unit(np.einsum("ij,ijk->ik", _weights(surface, face, points), surface.normals()[face]))
    there = _unit(_nearest_values(original, original.normals(), points))
    return float(np.degrees(np.arccos(np.einsum("ij,ij->i", own, there).clip(-1, 1))).mean())


def _unit(vectors: Arrays) -> Arrays:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)


def material_error(_: MeshArrays, obj: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Return the part of the samples that have another material than the nearest point of the original."""
    if len(obj.data.materials) < 2:
        return None
    original, surface = Surface(obj.data), Surface(mesh)
    points, face = _samples(surface)
    near = ClosestPoints(original.points, original.faces).query(points)[1]
    one, other = (_materials(m) for m in (mesh, obj.data))
    return float((one[face] != other[near]).mean())


def _materials(mesh: bpy.types.Mesh) -> Arrays:
    index = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    polygon = np.zeros(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    return index[polygon]


def key_error(source: MeshArrays, _: bpy.types.Object, mesh: bpy.types.Mesh) -> float | None:
    """Return the mean difference of shape keys' displacements, as a part of the key's largest; the worst key's."""
    if source.keys is None or mesh.shape_keys is None:
        return None
    original = ClosestPoints(source.keys.neutral.astype(np.float64), source.triangles)
    neutral = np.zeros(len(mesh.vertices) * 3)
    mesh.shape_keys.key_blocks[0].points.foreach_get("co", neutral)
    closest, face, _squared = original.query(neutral.reshape(-1, 3))
    a, b, c = source.keys.neutral[source.triangles[face]].transpose(1, 0, 2).astype(np.float64)
    solved = np.einsum("ijk,ik->ij", np.linalg.pinv(np.stack((b - a, c - a), axis=-1)), closest - a)
    weights = np.concatenate((1 - solved.sum(axis=1, keepdims=True), solved), axis=1)
    worst = 0.0
    for offsets, block in zip(source.keys.offsets, mesh.shape_keys.key_blocks, strict=True):
        most = float(np.linalg.norm(offsets, axis=1).max())
        points = np.zeros(len(mesh.vertices) * 3)
        block.points.foreach_get("co", points)
        there = np.einsum("ij,ijk->ik", weights, offsets[source.triangles[face]])
        if most:
            apart = np.linalg.norm((points - neutral).reshape(-1, 3) - there, axis=1).mean()
            worst = max(worst, float(apart) / most)
    return worst


def posed_deviation(obj: bpy.types.Object, *meshes: bpy.types.Mesh) -> list[float] | None:
    """Return how far meshes are from the original on average, posed by its armature in three frames."""
    armatures = [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE" and modifier.object]
    if not armatures or not bpy.data.actions:
        return None
    start, end = bpy.data.actions[0].frame_range
    original, sums = obj.data, np.zeros(len(meshes))
    armatures[0].show_viewport = True
    for part in (0.2, 0.5, 0.8):
        bpy.context.scene.frame_set(int(start + part * (end - start)))
        surfaces = []
        for mesh in (original, *meshes):
            obj.data = mesh
            bpy.context.view_layer.update()
            evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
            surface = Surface(evaluated.to_mesh())
            surfaces.append((surface.points, surface.faces))
        sums += [measure(*surfaces[0], *surface, samples=SAMPLES).symmetric.mean for surface in surfaces[1:]]
    obj.data = original
    armatures[0].show_viewport = False
    bpy.context.scene.frame_set(int(start))
    return list(sums / 3)


FIGURES: dict[str, Callable[[MeshArrays, bpy.types.Object, bpy.types.Mesh], float | None]] = {
    "UV error": uv_error,
    "UV triangles turned": flipped,
    "more of negative area": negative,
    "normals, degrees": normal_error,
    "material elsewhere": material_error,
    "shape keys": key_error,
}

if __name__ == "__main__":
    main()
