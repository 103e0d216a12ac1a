# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engine starts from: the quadric of each vertex, weighted as the options ask."""

import numpy as np

from .attribute_quadrics import with_attributes
from .border_planes import planar_edges
from .guidance import Guidance
from .lines import MATERIAL, Lines
from .mesh import Floats
from .options import Options
from .prepare import Prepared
from .quadrics import anchored, area_normals, axis_plane_quadrics, boundary_quadrics, plane_quadrics
from .variation import surface_variation

# a border of materials is seen at once, a seam only where the texture differs across it
_BORDER = 10.0
# what is mirrored or set side by side at a plane shows every gap
_PLANAR = 100.0
# least weight of all: planes of none could not be solved
_LEAST = 1e-6


def initial_quadrics(mesh: Prepared, options: Options, guidance: Guidance | None = None) -> Floats:
    """Weigh the mesh: Equation 9, and the planes that hold boundaries.

    Parameters
    ----------
    mesh : Prepared
    options : Options
    guidance : Guidance, optional
        Lines that are held in their place too, and what each vertex counts.

    Returns
    -------
    ndarray, (n, 12 or wider) float64
        See `quadrics`; without columns for "feature", which has none.
    """
    if options.method == "feature":
        return np.zeros((mesh.points.shape[1], 0))
    normals, areas = area_normals(mesh.points, mesh.faces)
    parts = plane_quadrics(mesh.faces, normals, areas, mesh.points.shape[1], area_weighted=options.area_weighted)
    if options.boundary_weight > 0 and len(mesh.boundary) and options.boundary_lines != "ignored":
        sides = mesh.boundary
        face = sides % mesh.faces.shape[1]
        parts += boundary_quadrics(mesh.points, normals.take(face, axis=1) / np.maximum(areas.take(face), 1e-300),
                                   mesh.boundary_edges, options.boundary_weight)
        parts += axis_plane_quadrics(mesh.points, planar_edges(mesh.points, mesh.boundary_edges), mesh.boundary_edges,
                                     _PLANAR * options.boundary_weight)
    if guidance is not None and guidance.lines is not None and options.line_weight > 0:
        parts += line_quadrics(mesh.points, guidance.lines, options.line_weight)
    if options.method in ("so", "eso"):
        rings = 1 if options.method == "so" else int(options.rings)
        weights = surface_variation(mesh.points.T, mesh.faces.T, rings, normals.T)
        mean = weights.mean()
        if mean > 0:
            parts *= factors(weights / mean, options)
    if guidance is not None and guidance.importance is not None:
        parts *= guidance.importance
    quadrics = anchored(parts, mesh.points, options.memory)
    if guidance is None or guidance.lines is None or options.attribute_weight == 0:
        return quadrics
    return with_attributes(quadrics, mesh.points, guidance.lines, guidance.layers, options.attribute_weight,
                           guidance.importance)


def factors(weights: Floats, options: Options) -> Floats:
    """Return what the quadrics are multiplied by for these weights, (n,): each at least a part of their mean.

    Beside sharp edges, whose weights are a hundred times the others', smooth faces would else count for nothing.
    """
    return np.maximum(weights, max(options.weight_floor * weights.mean(), _LEAST)) ** options.weight_power


def line_quadrics(points: Floats, lines: Lines, weight: float) -> Floats:
    """Sum planes through line edges, perpendicular to both their faces: (6, n) float64; see `boundary_quadrics`."""
    sides = lines.pairs.compress(lines.kinds > 0, axis=1)
    normals, areas = area_normals(points, lines.faces)
    weights = np.where(lines.kinds.compress(lines.kinds > 0) & MATERIAL, weight * _BORDER, weight) / 2
    parts = np.zeros((6, points.shape[1]))
    for ends in (sides[:2], sides[2:]):
        face = ends[0] % lines.faces.shape[1]
        parts += boundary_quadrics(points, normals.take(face, axis=1) / np.maximum(areas.take(face), 1e-300),
                                   lines.faces.ravel().take(ends), weights)
    return parts
