# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals and areas of faces, and area-weighted normals of vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def face_area_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Return the normal of each face, as long as the face's area is large.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles

    Returns
    -------
    (m, 3) float64, half the cross product of two sides; zero for a face without area
    """
    a, b, c = (np.take(vertices, faces[:, i], axis=0) for i in range(3))
    ux, uy, uz = (b - a).T
    vx, vy, vz = (c - a).T
    # written out: np.cross takes several times as long on rows of three
    cross = np.empty((len(faces), 3))
    cross[:, 0] = uy * vz - uz * vy
    cross[:, 1] = uz * vx - ux * vz
    cross[:, 2] = ux * vy - uy * vx
    cross *= 0.5
    return cross


def lengths(vectors: Floats) -> Floats:
    """Return the Euclidean length of each row: (k, 3) to (k,) float64.

    Rows are scaled first, so that neither 1e-170 underflows nor 1e170 overflows.
    """
    scale = float(np.abs(vectors).max(initial=0.0))
    if scale == 0.0 or not np.isfinite(scale):
        return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    scaled = vectors / scale
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", scaled, scaled)) * scale)


def unit(vectors: Floats) -> Floats:
    """Return each row at length one, and zero where it has no direction: (k, 3) float64."""
    length = lengths(vectors)[:, None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def face_areas(vertices: Floats, faces: Ints) -> Floats:
    """Return the area of each face: (n, 3) positions and (m, 3) triangles to (m,) float64."""
    return lengths(face_area_vectors(vertices, faces))


def face_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return the unit normal of each face, zero where it has no area: (m, 3) float64."""
    return unit(face_area_vectors(vertices, faces))


def vertex_normals(vertices: Floats, faces: Ints, area_vectors: Floats | None = None) -> Floats:
    """Return the unit normal of each vertex: the mean of its faces' normals weighted by area.

    Parameters
    ----------
    vertices : (n, 3) float64 positions
    faces : (m, 3) int64 triangles
    area_vectors : (m, 3) float64, what `face_area_vectors` gives, where it is at hand

    Returns
    -------
    (n, 3) float64; zero at a vertex whose faces have no area or cancel out
    """
    if area_vectors is None:
        area_vectors = face_area_vectors(vertices, faces)
    corners = faces.ravel()
    sums = np.empty((len(vertices), 3))
    for axis in range(3):
        weights = np.repeat(area_vectors[:, axis], 3)
        sums[:, axis] = np.bincount(corners, weights=weights, minlength=len(vertices))
    return unit(sums)
