# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine and its peers behind one small interface; each is meant to run in a process of its own.

An adapter takes (vertices (n, 3) float64, faces (m, 3) int64, target: triangles, options) and returns a `Run`. The
clock runs for the simplification alone: handing a mesh over to a peer's own data structure is not counted.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .meter import Meter

Option = str | int | float | bool | None
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "eso_lod_bench"


@dataclass(frozen=True)
class Run:
    """What one call gave: the simplified mesh, its seconds and its peak memory in bytes beyond the input."""

    vertices: np.ndarray
    faces: np.ndarray
    seconds: float
    peak: int


@dataclass(frozen=True)
class Peer:
    """One column of the benchmark: an adapter, its options, and what must be installed for it."""

    name: str
    adapter: Callable[..., Run]
    needs: str
    ours: bool = False
    endpoint: bool = False
    options: dict[str, Any] = field(default_factory=dict)

    def missing(self) -> str | None:
        """Return why this peer cannot run here, or None."""
        if self.needs == "node":
            return None if shutil.which("node") and install_meshoptimizer() else "needs node and npm"
        return None if importlib.util.find_spec(self.needs) else f"{self.needs} is not installed"


def install_meshoptimizer() -> bool:
    """Install the npm package meshoptimizer into the cache folder unless it is there; return whether it is."""
    package = CACHE / "node_modules" / "meshoptimizer"
    if not package.is_dir() and shutil.which("npm"):
        CACHE.mkdir(parents=True, exist_ok=True)
        subprocess.run(["npm", "install", "--silent", "--prefix", str(CACHE), "meshoptimizer"], check=False)
    return package.is_dir()


def decimate(vertices: np.ndarray, faces: np.ndarray, target: int) -> Run:
    """Run Blender's Decimate modifier, Collapse."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("benchmark")
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    subject = bpy.data.objects.new("benchmark", mesh)
    bpy.context.scene.collection.objects.link(subject)
    graph = bpy.context.evaluated_depsgraph_get()
    modifier = subject.modifiers.new("Decimate", "DECIMATE")
    modifier.ratio = (target + 0.5) / len(faces)
    with Meter() as meter:
        graph.update()
        result = subject.evaluated_get(graph).data
    result.calc_loop_triangles()
    points = np.empty(len(result.vertices) * 3, dtype=np.float32)
    corners = np.empty(len(result.loop_triangles) * 3, dtype=np.int32)
    result.vertices.foreach_get("co", points)
    result.loop_triangles.foreach_get("vertices", corners)
    return Run(points.reshape(-1, 3).astype(np.float64), corners.reshape(-1, 3), meter.seconds, meter.peak)


def meshlab(vertices: np.ndarray, faces: np.ndarray, target: int) -> Run:
    """Run MeshLab's quadric edge collapse with its fair settings."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces.astype(np.int32)))
    with Meter() as meter:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=target, qualitythr=1, preserveboundary=True, preservenormal=True
        )
    mesh = meshes.current_mesh()
    return Run(mesh.vertex_matrix(), mesh.face_matrix(), meter.seconds, meter.peak)


def vtk_quadric(vertices: np.ndarray, faces: np.ndarray, target: int) -> Run:
    """Run VTK's quadric decimation with volume preservation."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    points, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(vertices, deep=1))
    cells.SetData(3, numpy_to_vtkIdTypeArray(faces.astype(np.int64).ravel(), deep=1))
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    engine = vtkQuadricDecimation()
    engine.SetInputData(mesh)
    engine.VolumePreservationOn()
    engine.SetTargetReduction(1 - target / len(faces))
    with Meter() as meter:
        engine.Update()
    result = engine.GetOutput()
    corners = vtk_to_numpy(result.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return Run(vtk_to_numpy(result.GetPoints().GetData()).astype(np.float64), corners, meter.seconds, meter.peak)


def _scale(vertices: np.ndarray, diagonal: float | None) -> float:
    """Return the factor that gives the bounding box the wanted diagonal; 1 for None."""
    return diagonal / float(np.linalg.norm(np.ptp(vertices, axis=0))) if diagonal else 1.0


def fast_simplification(vertices: np.ndarray, faces: np.ndarray, target: int, *, diagonal: float | None = None) -> Run:
    """Run fast-simplification; its thresholds are absolute, so it does better on a mesh scaled up first."""
    import fast_simplification as package

    scale = _scale(vertices, diagonal)
    points, triangles = vertices * scale, faces.astype(np.int32)
    with Meter() as meter:
        points, corners = package.simplify(points, triangles, target_count=target)
    return Run(points / scale, corners, meter.seconds, meter.peak)


def pyfqmr(vertices: np.ndarray, faces: np.ndarray, target: int, *, diagonal: float | None = None) -> Run:
    """Run pyfqmr; of the same family as fast-simplification, and scaled for the same reason."""
    import pyfqmr as package

    scale = _scale(vertices, diagonal)
    engine = package.Simplify()
    engine.setMesh(vertices * scale, faces.astype(np.int32))
    with Meter() as meter:
        engine.simplify_mesh(target_count=target, verbose=0)
    points, corners, _ = engine.getMesh()
    return Run(points / scale, corners, meter.seconds, meter.peak)


def meshoptimizer(vertices: np.ndarray, faces: np.ndarray, target: int) -> Run:
    """Run `simplify` of meshoptimizer under Node: WebAssembly, endpoint placement."""
    script = Path(__file__).with_name("meshopt.mjs")
    library = CACHE / "node_modules" / "meshoptimizer" / "meshopt_simplifier.js"
    with tempfile.TemporaryDirectory() as folder:
        positions, indices, output = (Path(folder) / name for name in ("positions", "indices", "output"))
        # Node reads single precision: centred and scaled, so that it loses the least.
        centre, extent = vertices.mean(axis=0), np.ptp(vertices, axis=0).max() or 1.0
        ((vertices - centre) / extent).astype(np.float32).tofile(positions)
        faces.astype(np.uint32).tofile(indices)
        words = ["node", str(script), str(library), str(positions), str(indices), str(target * 3), str(output)]
        told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
        corners = np.fromfile(output, dtype=np.uint32).astype(np.int64)
    used, numbered = np.unique(corners, return_inverse=True)
    return Run(vertices[used], numbered.reshape(-1, 3), told["seconds"], told["peak"])


def ours(vertices: np.ndarray, faces: np.ndarray, target: int, **options: Option) -> Run:
    """Run the engine to one level, the whole call on arrays."""
    from eso_addon import simplify

    with Meter() as meter:
        result = simplify(vertices, faces, faces_target=target, **options)
    return Run(result.vertices, result.faces, meter.seconds, meter.peak)


def our_chain(vertices: np.ndarray, faces: np.ndarray, target: int, *, ratios: list[float], **options: Option) -> Run:
    """Make all levels of a chain in one call; the mesh returned is the last level, `target` is not used."""
    from eso_addon import lod_chain

    with Meter() as meter:
        levels = lod_chain(vertices, faces, ratios, **options)
    return Run(levels[-1].vertices, levels[-1].faces, meter.seconds, meter.peak)


def our_weights(vertices: np.ndarray, faces: np.ndarray, target: int, **options: Option) -> Run:
    """Compute the vertex weights alone; the mesh returned is the input."""
    from eso_addon import vertex_weights

    with Meter() as meter:
        vertex_weights(vertices, faces, **options)
    return Run(vertices, faces, meter.seconds, meter.peak)


CHAIN = [0.5, 0.25, 0.1, 0.05, 0.01]
PLAIN = {"refit": False}
END = {"placement": "endpoint", "refit": False}
PEERS = {
    peer.name: peer
    for peer in (
        Peer("decimate", decimate, "bpy"),
        Peer("meshlab", meshlab, "pymeshlab"),
        Peer("vtk", vtk_quadric, "vtkmodules"),
        Peer("fast-simplification", fast_simplification, "fast_simplification"),
        Peer("pyfqmr", pyfqmr, "pyfqmr"),
        Peer("fast-simplification scaled", fast_simplification, "fast_simplification", options={"diagonal": 100.0}),
        Peer("pyfqmr scaled", pyfqmr, "pyfqmr", options={"diagonal": 100.0}),
        Peer("meshoptimizer", meshoptimizer, "node", endpoint=True),
        Peer("qem", ours, "eso_addon", ours=True, options={"method": "qem", **PLAIN}),
        Peer("eso", ours, "eso_addon", ours=True, options={"method": "eso", "rings": 3, **PLAIN}),
        Peer("default", ours, "eso_addon", ours=True),
        Peer("qem end", ours, "eso_addon", ours=True, endpoint=True, options={"method": "qem", **END}),
        Peer("eso end", ours, "eso_addon", ours=True, endpoint=True, options={"method": "eso", **END}),
    )
}
# Not columns of the table: what the summary's other figures are made of, and the ablation's blank.
FIGURES = {
    peer.name: peer
    for peer in (
        Peer("chain", our_chain, "eso_addon", ours=True, options={"ratios": CHAIN, **PLAIN}),
        Peer("weights", our_weights, "eso_addon", ours=True, options={"method": "eso", "rings": 3}),
        Peer("ablation", ours, "eso_addon", ours=True),
    )
}
