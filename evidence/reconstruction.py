# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 8, 9 and 12 of Chen and Nishita: how close the levels of a stream are to the original."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.readers import Mesh

from .context import Context
from .models import subdivided
from .page import Pictures, Plot, Section, Table
from .plots import axes_row, count_axis, line
from .printed import QEM_FACES
from .raster import Camera, render
from .streams import Subject, subjects

STEPS = 9
SIDE = 220  # pixels of an image that is compared
METHODS: dict[str, dict[str, Any]] = {
    "feature": {"method": "feature", "epsilon": -0.2}, "ESO": {"method": "eso"}, "QEM": {"method": "qem"}}


def levels_section(context: Context) -> Section:
    """Make the section of Figures 8 and 9."""
    part = Section("6. Levels of a stream: Figures 8 and 9", problems=context.lack(("bunny_2503",)), raw=[])
    subject = next((subject for subject in subjects(context) if subject.name == "bunny_2503"), None)
    if subject is None:
        part.problems.append("no bunny is at hand")
        return part
    part.blocks.append(
        f"{subject.title}, {len(subject.mesh[1]):,} triangles, recorded with half-edge collapse by three methods, and "
        "read back level by level. Figure 8 is the mean squared distance from the original's vertices to the level's "
        "surface, over the squared diagonal. Figure 9 is the root mean square difference of pictures (grey, 0 to 255) "
        "from six sides, over the pixels that either shows.")
    steps = 3 if context.short else STEPS
    jobs = [(context.pool.store(subject.name, subject.mesh), name, steps) for name in METHODS]
    for (_, name, _), rows in zip(jobs, context.pool.map(curve, jobs), strict=True):
        if isinstance(rows, Exception):
            part.problems.append(f"{name}: {type(rows).__name__}: {rows}")
        else:
            part.raw += rows
    part.blocks.append(Plot("Figures 8 and 9: the levels against the original; lower is closer.", _curves(part.raw)))
    part.blocks.append(_verdict(part.raw))
    return part


def _curves(rows: list[dict[str, Any]]) -> Figure:
    """Draw Figures 8 and 9."""
    figure, (left, right) = axes_row(2, width=5.4, height=4.0)
    for name in METHODS:
        mine = [row for row in rows if row["method"] == name]
        if mine:
            faces = [row["faces"] for row in mine]
            line(left, faces, [row["squared"] for row in mine], name)
            line(right, faces, [row["difference"] for row in mine], name)
    left.set(xlabel="triangles of the level", ylabel="mean squared distance / diagonal²", xscale="log", yscale="log",
             title="Figure 8: geometry")
    right.set(xlabel="triangles of the level", ylabel="difference of pictures (grey levels)", xscale="log",
              title="Figure 9: appearance")
    for axes in (left, right):
        count_axis(axes)
        axes.legend()
    return figure


def curve(path: Any, name: str, steps: int) -> list[dict[str, Any]]:  # noqa: ANN401
    """Return the two distances at each level of one method's stream."""
    from eso_addon import progressive

    from .cases import load

    mesh = load(path)
    least = 1 if name == "feature" else QEM_FACES
    stream = progressive(*mesh, base_faces=least, threads=1, **METHODS[name])
    last = max(stream.base_faces, 8)
    found = []
    cameras = _six_sides(mesh)
    views = [_grey(mesh, camera) for camera in cameras]
    diagonal = float(np.linalg.norm(np.ptp(mesh[0], axis=0)))
    for faces in np.unique(np.geomspace(last, len(mesh[1]) * 0.9, steps).astype(int)).tolist():
        level = stream.at(faces=faces)
        coarse = (level.vertices.astype(np.float64), level.faces.astype(np.int64))
        found.append({"method": name, "faces": len(coarse[1]),
                      "squared": squared_distance(mesh[0], coarse) / diagonal**2,
                      "difference": _difference(views, [_grey(coarse, camera) for camera in cameras])})
    return found


def squared_distance(points: np.ndarray, mesh: Mesh) -> float:
    """Return the mean squared distance of points to a surface."""
    from eso_addon.core.closest import ClosestPoints

    closest = ClosestPoints(*mesh).query(points)[0]
    return float(((points - closest) ** 2).sum(axis=1).mean())


def _six_sides(mesh: Mesh) -> list[Camera]:
    return [Camera.around(mesh[0], azimuth, elevation, "y")
            for azimuth, elevation in ((0, 0), (90, 0), (180, 0), (270, 0), (0, 89), (0, -89))]


def _grey(mesh: Mesh, camera: Camera) -> np.ndarray:
    return render(mesh, camera, SIDE, wire=False).astype(np.float64) @ (0.299, 0.587, 0.114)


def _difference(one: list[np.ndarray], other: list[np.ndarray]) -> float:
    empty = one[0][0, 0]
    squares = [(a - b)[(a != empty) | (b != empty)] ** 2 for a, b in zip(one, other, strict=True)]
    return float(np.sqrt(np.concatenate(squares).mean()))


def _verdict(raw: list[dict[str, Any]]) -> str:
    def at(name: str, faces: float, kind: str) -> float:
        mine = sorted((row["faces"], row[kind]) for row in raw if row["method"] == name)
        if not mine:
            return float("nan")
        logs = np.interp(np.log(faces), np.log([face for face, _ in mine]), np.log([value for _, value in mine]))
        return float(np.exp(logs))

    if not raw:
        return "Nothing was measured."
    levels = (500, 1000, 2000)
    words = "; ".join(f"at {faces:,} triangles {at('feature', faces, 'squared') / at('QEM', faces, 'squared'):.1f} "
                      f"(ESO {at('ESO', faces, 'squared') / at('QEM', faces, 'squared'):.2f})" for faces in levels)
    pictures = "; ".join(f"at {faces:,} {at('feature', faces, 'difference') / at('QEM', faces, 'difference'):.2f}"
                         for faces in levels)
    return (f"The paper says that the qualities of both methods' levels are almost the same. Here the feature method's "
            f"mean squared distance over QEM's is {words}; the difference of pictures over QEM's is {pictures}. It "
            f"weighs edges by the normals as they are, and never by how far the surface has moved already.")


def subdivision_section(context: Context) -> Section:
    """Make the section of Figure 12."""
    part = Section("7. A subdivided mesh reconstructed: Figure 12", problems=context.lack(("tiger_956",)), raw=[])
    subject = next((subject for subject in subjects(context) if subject.name == "tiger"), None)
    if subject is None:
        part.problems.append("neither the tiger nor a stand-in is at hand")
        return part
    model = context.models[next(name for name in ("tiger_956", "bone", "cow") if name in context.models)]
    _compare(context, part, subject, model.mesh)
    return part


def _compare(context: Context, part: Section, subject: Subject, coarse: Mesh) -> None:
    from eso_addon import progressive
    from eso_addon.progressive.progressive import from_bytes

    once = subdivided(coarse, 1)
    stream = from_bytes(progressive(*subject.mesh, base_faces=1, method="feature", epsilon=-0.2).to_bytes())
    level, whole = stream.at(faces=len(once[1])), stream.restore()
    base = stream.at(faces=0)
    meshes = [("subdivided", subject.mesh), ("reconstructed whole", _mesh(whole)),
              ("subdivided once", once), ("reconstructed to as many", _mesh(level)),
              ("the simplified mesh", _mesh(base))]
    same = same_faces(subject.mesh, _mesh(whole))
    diagonal = float(np.linalg.norm(np.ptp(subject.mesh[0], axis=0)))
    rows: list[list] = []
    for label, mesh in meshes[1:]:
        distance = float(np.sqrt(squared_distance(subject.mesh[0], mesh))) / diagonal
        part.raw.append({"mesh": label, "faces": len(mesh[1]), "rms": distance})
        rows.append([label, len(mesh[1]), f"{distance * 1e3:.3f}"])
    part.blocks += [
        f"{subject.title}: {len(subject.mesh[1]):,} triangles, simplified by the feature method at ε −0.2 to "
        f"{len(base.faces):,}, written as a stream and read back. The paper says that its reconstruction to the face "
        "count of one subdivision is similar to that subdivision; the table has by how much.",
        Pictures("Figure 12: as subdivided, and as reconstructed.",
                 [(context.picture(mesh, subject.camera), f"{label}: {len(mesh[1]):,}") for label, mesh in meshes],
                 columns=2),
        Table("Root mean square distance from the vertices of the subdivided mesh, in 1e-3 of the diagonal",
              ["mesh", "triangles", "distance"], rows),
        "Reconstructed whole it **equals the original**: every face with the same three positions in single precision."
        if same else "Reconstructed whole it **differs from the original**: this is a fault."]
    part.raw.append({"mesh": "whole", "equal": same})


def _mesh(level: Any) -> Mesh:  # noqa: ANN401
    return level.vertices.astype(np.float64), level.faces.astype(np.int64)


def same_faces(one: Mesh, other: Mesh) -> bool:
    """Tell whether two meshes have the same faces in single precision, whatever their order."""
    def canonical(mesh: Mesh) -> np.ndarray:
        points = np.ascontiguousarray(mesh[0].astype(np.float32))
        rows = np.unique(points, axis=0, return_inverse=True)
        corners = rows[1].reshape(-1)[mesh[1]]
        first = corners.argmin(axis=1)[:, None]
        turned = np.take_along_axis(corners, (first + np.arange(3)) % 3, axis=1)
        return rows[0][turned[np.lexsort(turned.T[::-1])]]

    a, b = canonical(one), canonical(other)
    return a.shape == b.shape and bool((a == b).all())
