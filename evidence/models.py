# SPDX-License-Identifier: GPL-3.0-or-later
"""The papers' models that are at hand, what stands in for the others, and from where each is looked at."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.meshes import shipped_folder
from benchmarks.readers import Mesh, read_mesh

from .raster import Camera


@dataclass(frozen=True)
class Model:
    """A mesh with a name; `origin` says whether it is the paper's own."""

    name: str
    title: str
    origin: str
    make: Callable[[], Mesh]
    up: str = "y"
    azimuth: float = 30.0
    elevation: float = 12.0
    own: bool = False
    path: Path | None = None

    @cached_property
    def mesh(self) -> Mesh:
        """The vertices, (n, 3) float64, and triangles, (m, 3) int64."""
        return self.make()

    @property
    def triangles(self) -> int:
        """How many there are."""
        return len(self.mesh[1])

    @property
    def label(self) -> str:
        """The name with what it is."""
        return f"{self.title} ({self.triangles:,} triangles; {self.origin})"

    @cached_property
    def camera(self) -> Camera:
        """Where the model is looked at from: its largest part fills the picture."""
        return Camera.around(self.mesh[0][_largest_part(self.mesh)], self.azimuth, self.elevation, self.up)


# name: file, title, origin, whether it is the paper's own, up, azimuth, elevation
_FILES: dict[str, tuple[str, str, str, bool, str, float, float]] = {
    "dragon": ("dragon_25k.obj", "Dragon", "the ESO paper's own", True, "y", 205, 10),
    "femur": ("femur_15k.obj", "Femur", "stand-in: the paper's has 153,322", False, "z", 30, 10),
    "isis": ("isis_5k.stl", "Isis", "stand-in: the paper's has 200,000", False, "z", 300, 8),
    "bunny_2503": ("bunny_2503.obj", "Bunny", "as in the paper", True, "y", 20, 12),
    "hand": ("hand.obj", "Hand", "stand-in: another scan than the paper's", False, "y", 210, 12),
    "cessna": ("cessna.obj", "Cessna", "as in the paper", True, "y", 35, 24),
    "fandisk": ("fandisk.obj", "Fandisk", "as in the paper", True, "y", 120, 26),
    "tiger_956": ("tiger.off", "Tiger", "as in the paper, before its subdivision", True, "y", 75, 12),
    "holes": ("many_small_holes.ply", "Scan with holes", "in place of the paper's femur", False, "y", 215, 12),
    "bunny": ("bunny.obj", "Stanford bunny", "not in the papers", False, "y", 20, 12),
    "horse": ("horse.ply", "Horse", "not in the papers", False, "z", 30, 12),
    "rocker-arm": ("rocker-arm.obj", "Rocker arm", "not in the papers", False, "y", 60, 25),
}
_SHIPPED: dict[str, tuple[str, str, str, bool, str, float, float]] = {
    "cow": ("cow.obj", "Cow", "the ESO paper's own", True, "y", 290, 10),
    "bunny": ("bunny.obj", "Bunny of MeshLab", "not in the papers", False, "y", 20, 12),
    "holes": ("bunny10k_textured.obj", "Bunny, open below", "in place of the paper's femur", False, "z", 300, 15),
    "airplane": ("airplane.obj", "Airplane", "not in the papers", False, "y", 120, 30),
    "bone": ("bone.ply", "Bone", "not in the papers", False, "z", 30, 15),
}
WANTED = ("cow", "dragon", "femur", "isis", "bunny_2503", "hand", "cessna", "fandisk", "tiger_956")


def find_models(folder: Path | None) -> tuple[dict[str, Model], dict[str, str]]:
    """Return the models at hand, and the papers' models that are not, each with what is missing."""
    found: dict[str, Model] = {}
    for place, table in ((folder, _FILES), (shipped_folder(), _SHIPPED)):
        for name, (file, title, origin, own, up, azimuth, elevation) in table.items():
            if place is not None and name not in found and (place / file).is_file():
                found[name] = Model(name, title, origin, _reader(place / file), up, azimuth, elevation, own,
                                    place / file)
    missing = {}
    for name in WANTED:
        if name not in found:
            file = (_FILES.get(name) or _SHIPPED[name])[0]
            missing[name] = f"{file} is not in {folder}" if folder else f"{file}: give MODELS=DIR, a folder with it"
    return found, missing


def _reader(path: Path) -> Callable[[], Mesh]:
    return lambda: _read_stl(path) if path.suffix == ".stl" else read_mesh(path)


def _read_stl(path: Path) -> Mesh:
    """Read a binary STL; corners at one place become one vertex."""
    data = path.read_bytes()
    (count,) = struct.unpack("<I", data[80:84])
    kind = np.dtype([("normal", "<3f4"), ("corners", "<9f4"), ("attribute", "<u2")])
    corners = np.frombuffer(data, kind, count, 84)["corners"].reshape(-1, 3)
    vertices, numbered = np.unique(corners, axis=0, return_inverse=True)
    return vertices.astype(np.float64), numbered.reshape(-1, 3).astype(np.int64)


def _largest_part(mesh: Mesh) -> np.ndarray:
    """Return the vertices of the part with most faces."""
    from eso_addon.core.adjacency import vertex_components

    part = vertex_components(mesh[1], len(mesh[0]))
    return np.flatnonzero(part == np.bincount(part[mesh[1][:, 0]]).argmax())


def subdivided(mesh: Mesh, times: int) -> Mesh:
    """Subdivide a closed mesh by Kobbelt's √3 scheme: three triangles for one, each time.

    Every face gets a vertex at its middle, edges of the old mesh are flipped, and old vertices are smoothed.
    """
    vertices, faces = mesh
    for _ in range(times):
        count = len(vertices)
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        face = np.repeat(np.arange(len(faces)), 3)
        forward = np.argsort(start * count + end)
        backward = np.argsort(end * count + start)
        if not np.array_equal((start * count + end)[forward], (end * count + start)[backward]):
            raise ValueError("the √3 scheme here is for closed meshes")
        beyond = np.empty_like(face)
        beyond[forward] = face[backward]
        valence = np.bincount(start, minlength=count)
        near = np.stack([np.bincount(start, vertices[end, axis], count) for axis in range(3)], axis=1)
        share = ((4 - 2 * np.cos(2 * np.pi / np.maximum(valence, 1))) / 9)[:, None]
        smooth = (1 - share) * vertices + share * near / np.maximum(valence, 1)[:, None]
        vertices = np.concatenate((smooth, vertices[faces].mean(axis=1)))
        # of each edge's two halves: its start, then the middle beyond, then the middle of its own face
        faces = np.stack((start, count + beyond, count + face), axis=1)
    return vertices, faces


def sharp_edges_of(model: Model, mesh: Mesh) -> np.ndarray | None:
    """Return the edges where an OBJ's materials or normals differ, as pairs of vertices; None where it has neither."""
    if model.path is None or model.path.suffix != ".obj" or model.name != "cessna":
        return None
    from eso_addon.core.features import sharp_edges

    material, normals, materials, rows = "", [], [], []
    for line in model.path.read_text(errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["usemtl"]:
            material = words[1]
        elif words[:1] == ["vn"]:
            normals.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corner = [int(word.split("/")[-1]) - 1 for word in words[1:]]
            for place in range(1, len(corner) - 1):
                rows.append([corner[0], corner[place], corner[place + 1]])
                materials.append(material)
    if len(rows) != len(mesh[1]):
        return None
    return sharp_edges(*mesh, face_values=[np.array(materials)], corner_values=[np.array(normals)[np.array(rows)]])
