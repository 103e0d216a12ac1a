# SPDX-License-Identifier: GPL-3.0-or-later
"""Points spread evenly over the faces and edges of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .adjacency import unique_edges
from .normals import face_areas, lengths

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def face_samples(vertices: Floats, faces: Ints, count: int, rng: np.random.Generator) -> tuple[Floats, Ints, Floats]:
    """Spread points evenly over the area of a mesh, one in each of `count` equal parts of it in the faces' order.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles, some of them with an area
    count : number of points, above zero
    rng : the generator; the same state gives the same points

    Returns
    -------
    points : (count, 3) float64
    face : (count,) int64, ascending, the face of each point
    weights : (3, count) float64, the barycentric coordinates of each point
    """
    face = _strata(face_areas(vertices, faces), count, rng)
    # the square root makes the points even over a triangle (Osada et al. 2002, Shape distributions, Equation 1)
    out, turn = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - out, out * (1 - turn), out * turn])
    points = np.zeros((count, 3))
    for corner, weight in enumerate(weights):
        points += weight[:, None] * vertices.take(faces[:, corner].take(face), axis=0)
    return points, face, weights


def edge_samples(vertices: Floats, faces: Ints, count: int, rng: np.random.Generator) -> Floats:
    """Spread points evenly over the length of a mesh's edges: (count, 3) float64."""
    edges, _ = unique_edges(faces, len(vertices))
    start, end = vertices.take(edges[:, 0], axis=0), vertices.take(edges[:, 1], axis=0)
    edge = _strata(lengths(end - start), count, rng)
    along = rng.random((count, 1))
    first, last = start.take(edge, axis=0), end.take(edge, axis=0)
    return first + along * (last - first)


def _strata(sizes: Floats, count: int, rng: np.random.Generator) -> Ints:
    """Return (count,) indices, one drawn in each of `count` equal parts of the cumulated sizes."""
    total = np.cumsum(sizes)
    index = np.searchsorted(total, (np.arange(count) + rng.random(count)) * (total[-1] / count), side="right")
    return np.minimum(index, len(sizes) - 1)
