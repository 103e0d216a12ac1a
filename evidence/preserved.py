# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 18 to 24 of the ESO paper: horns, teeth, rims of holes, and the levels."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.readers import Mesh

from .cases import VARIANTS
from .context import ESO_MODELS, Context
from .models import Model
from .page import Pictures, Section, Table
from .raster import Camera

SIDE_BY_SIDE = ("QEM", "CF", "ESO 3", "ESO default")
HOLES_LEFT = 0.1


def _looks(name: str, camera: Camera) -> list[tuple[str, Camera]]:
    """Return what the paper looks at."""
    if name == "cow":
        return [("whole", camera), ("horns and neck", camera.close(0.70, 0.30, 3.0))]
    return [("head and teeth", camera.close(0.02, 0.80, 4.6))]


def section(context: Context) -> Section:
    """Make the section."""
    part = Section("4. What is preserved", problems=context.lack(ESO_MODELS), raw=[])
    part.blocks.append(
        "The same camera for all of a row, flat shaded, with wire; what is seen from inside is orange. QEM, CF and ESO "
        "are as printed, the last picture is what `simplify` does when nothing is said.")
    levels = context.levels()
    for name, percent, what in (("cow", 10, "Figure 18"), ("dragon", 10, "Figure 19")):
        model = context.models.get(name)
        if model is None or (context.short and name != "cow"):
            continue
        for look, camera in _looks(name, model.camera):
            meshes = [(f"original, {model.triangles:,} triangles", model.mesh)]
            meshes += [(f"{variant}, {levels[name, variant, percent].faces:,}", levels[name, variant, percent].mesh)
                       for variant in SIDE_BY_SIDE if (name, variant, percent) in levels]
            caption = f"{what}: {model.title.lower()}, {look}, at {context.target(model, percent):,} triangles."
            part.blocks.append(_row(context, caption, meshes, camera))
    if "holes" in context.models and not context.short:
        _holes(context, part)
    part.blocks.append("### The levels (Figures 21 to 24)")
    for model in context.eso_models:
        items = [(context.picture(model.mesh, model.camera), f"original, {model.triangles:,}")]
        items += [(context.picture(level.mesh, model.camera), f"{percent} %, {level.faces:,} triangles")
                  for percent in context.percent if (level := levels.get((model.name, "ESO 3", percent)))]
        part.blocks.append(Pictures(f"{model.label}: ESO as printed, three rings.", items, columns=3))
    return part


def _row(context: Context, caption: str, meshes: list[tuple[str, Mesh]], camera: Camera) -> Pictures:
    return Pictures(caption, [(context.picture(mesh, camera, 760), label) for label, mesh in meshes],
                    columns=min(len(meshes), 3))


def _holes(context: Context, part: Section) -> None:
    model = context.models["holes"]
    target = round(model.triangles * HOLES_LEFT)
    found, failed = context.pool.chains({"holes": model.mesh}, {name: VARIANTS[name] for name in SIDE_BY_SIDE},
                                        {"holes": [target]})
    part.problems += failed
    by_name = {level.variant: level for level in found}
    meshes = [(f"original, {model.triangles:,} triangles", model.mesh)]
    meshes += [(f"{name}, {by_name[name].faces:,}", by_name[name].mesh) for name in SIDE_BY_SIDE if name in by_name]
    caption = f"Figure 20: rims of holes, on {model.title.lower()} ({model.origin}), at {target:,} triangles."
    part.blocks.append(_row(context, caption, meshes, _hole_camera(model)))
    before = _rim(model.mesh)
    rows: list[list] = []
    for label, mesh in meshes:
        length, edges = _rim(mesh)
        figures: dict[str, Any] = {"rim_edges": edges, "rim_length": length / before[0]}
        part.raw.append({"model": "holes", "mesh": label, "faces": len(mesh[1]), **figures})
        rows.append([label.split(",")[0], len(mesh[1]), edges, length / before[0]])
    part.blocks.append(Table("The rims: boundary edges, and their length over the original's",
                             ["mesh", "triangles", "edges", "length"], rows))


def _hole_camera(model: Model) -> Camera:
    if model.triangles > 5000:  # the bunny: look at its base
        return model.camera.close(0.0, -0.1, 1.6)
    return model.camera.close(0.0, 0.15, 2.2)


def _rim(mesh: Mesh) -> tuple[float, int]:
    """Return the length and the number of boundary edges."""
    from eso_addon.core.adjacency import boundary_edges

    vertices, faces = mesh
    edges = boundary_edges(faces, len(vertices))
    return float(np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1).sum()), len(edges)
