# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches cost no quality: the engine against an exact collapse off a heap that begins with the same quadrics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eso_addon.core.blocks import Blocks
from eso_addon.core.collapse import Rules, collapse_steps
from eso_addon.core.deviation import Deviation, measure
from eso_addon.core.manifold import boundary_sides
from eso_addon.core.prepare import Prepared, prepare
from eso_addon.core.quadrics import anchored, area_normals, boundary_quadrics, plane_quadrics
from eso_addon.core.variation import surface_variation

from . import shapes
from .oracle import endpoint, optimal, oracle_simplify
from .shapes import Floats, Ints, Mesh, read_obj

SAMPLES = 10_000


def quadrics_of(mesh: Prepared, method: str) -> Floats:
    """Return Equation 9 with boundary planes, put together from the public parts."""
    normals, areas = area_normals(mesh.points, mesh.faces)
    parts = plane_quadrics(mesh.faces, normals, areas, mesh.points.shape[1], area_weighted=True)
    if mesh.opened.any():
        sides = boundary_sides(mesh.faces, mesh.opened)
        face = sides % mesh.faces.shape[1]
        edges = np.stack((mesh.faces.ravel()[sides], np.roll(mesh.faces, -1, axis=0).ravel()[sides]))
        parts += boundary_quadrics(mesh.points, normals[:, face] / areas[face], edges, 1.0)
    if method == "eso":
        weights = surface_variation(mesh.points.T, mesh.faces.T, 3)
        parts *= (weights / weights.mean()) ** 0.5
    return anchored(parts, mesh.points, Rules().memory)


def engine(mesh: Prepared, quadrics: Floats, rules: Rules, target: int) -> Mesh:
    blocks = Blocks(1)
    _, record = shapes.drained(
        collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, None, target, rules, blocks))
    points, corners, _, _ = record.level(mesh.points.T, mesh.faces.T, record.length_for(target))
    return points, corners


def compact(points: Floats, corners: Ints) -> Mesh:
    used, faces = np.unique(corners, return_inverse=True)
    return points[used], faces.reshape(-1, 3)


def oracle(mesh: Prepared, quadrics: Floats, rules: Rules, target: int) -> Mesh:
    result = oracle_simplify(mesh.points.T, mesh.faces.T, quadrics[:, :10], target, least_cosine=rules.flip,
                             place=endpoint if rules.endpoint else optimal)
    return result.vertices, result.faces


def deviation(mesh: Prepared, level: Mesh) -> Deviation:
    return measure(mesh.points.T, mesh.faces.T, *compact(*level), samples=SAMPLES)


@pytest.fixture(scope="module")
def meshes(sample_meshes: Path) -> list[Prepared]:
    """Give the cow, the bunny at a size that the oracle bears, and a bumpy ring."""
    bunny = prepare(*read_obj(sample_meshes / "bunny10k_textured.obj"))
    small = prepare(*compact(*engine(bunny, quadrics_of(bunny, "qem"), Rules(), 3000)))
    ring = shapes.noisy(shapes.torus(30, 40), np.random.default_rng(0), 0.01)
    return [prepare(*read_obj(sample_meshes / "cow.obj")), small, prepare(*ring)]


@pytest.mark.parametrize("rules", [Rules(), Rules(endpoint=True)], ids=["optimal", "endpoint"])
def test_as_good_as_the_exact_collapse(meshes: list[Prepared], rules: Rules) -> None:
    """Mean and maximum deviation within 5 % of the oracle's, in the geometric mean over meshes, counts and weights."""
    ratios = []
    for mesh in meshes:
        for method in ("qem", "eso") if not rules.endpoint else ("eso",):
            quadrics = quadrics_of(mesh, method)
            for part in (0.2, 0.05):
                target = round(mesh.faces.shape[1] * part)
                levels = [run(mesh, quadrics, rules, target) for run in (engine, oracle)]
                ours, exact = (deviation(mesh, level).symmetric for level in levels)
                ratios.append((ours.mean / exact.mean, ours.maximum / exact.maximum))
    mean, maximum = np.exp(np.log(ratios).mean(axis=0))
    assert mean < 1.05, ratios
    assert maximum < 1.05, ratios
