# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals and areas of faces, and area-weighted normals of vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# faces at a time: what is made of them then stays in the processor's second cache
BLOCK = 8192


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
    columns = np.ascontiguousarray(vertices.T)
    areas = np.empty((len(faces), 3))
    for start in range(0, len(faces), BLOCK):
        corners = np.ascontiguousarray(faces[start : start + BLOCK].T)
        (ux, vx), (uy, vy), (uz, vz) = (_sides(column, corners) for column in columns)
        # written out: np.cross takes several times as long on rows of three
        part = areas[start : start + BLOCK]
        np.subtract(uy * vz, uz * vy, out=part[:, 0])
        np.subtract(uz * vx, ux * vz, out=part[:, 1])
        np.subtract(ux * vy, uy * vx, out=part[:, 2])
        part *= 0.5
    return areas


def _sides(column: Floats, corners: Ints) -> tuple[Floats, Floats]:
    """Return one coordinate of the two sides that leave the first corner."""
    first = np.take(column, corners[0])
    return np.take(column, corners[1]) - first, np.take(column, corners[2]) - first


def lengths(vectors: Floats) -> Floats:
    """Return the Euclidean length of each row: (k, 3) to (k,) float64.

    Very small and very large rows are scaled first, so that their squares neither vanish nor overflow.
    """
    squares = np.einsum("ij,ij->i", vectors, vectors)
    top = float(squares.max(initial=0.0))
    if 1e-200 < top < 1e300:
        return np.asarray(np.sqrt(squares, out=squares))
    scale = float(np.abs(vectors).max(initial=0.0)) or 1.0
    scaled = vectors / scale
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", scaled, scaled)) * scale)


def unit(vectors: Floats) -> Floats:
    """Return each row at length one, and zero where it has no direction: (k, 3) float64."""
    length = lengths(vectors)
    length[length == 0.0] = 1.0
    return vectors / length[:, None]


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
    corners = np.ascontiguousarray(faces.T)
    columns = np.ascontiguousarray(area_vectors.T)
    return unit(np.array([sum(np.bincount(corner, column, len(vertices)) for corner in corners)
                          for column in columns]).T)
