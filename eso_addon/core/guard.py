# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a step each vertex may take: less where a face would turn over or get thin."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .normals import face_area_vectors, lengths

Floats = NDArray[Any]
Ints = NDArray[np.int64]

HALVINGS = 3  # before a step is not taken at all
_TURN = 0.5  # least cosine between a face's normals before and after
_SHAPE = 0.5  # least area over squared edges afterwards, relative to before


def hold_flips(vertices: Floats, step: Floats, share: Floats, faces: Ints, start: Floats, judged: Ints) -> None:
    """Halve the share of the step, and at last take none, around those faces that turn or get thin since the start.

    Parameters
    ----------
    vertices, step : (k, 3) float64
        The vertices hold no such face yet.
    share : (k,) float64
        Changed in place.
    faces : (m, 3) int64
    start : (k, 3) float64
        Where the vertices stood when the faces came to be.
    judged : (j,) int64
        The faces that may be bad.
    """
    while len(judged):
        corners = faces.take(judged, axis=0)
        moved: Floats = vertices + share[:, None] * step
        before, after = face_area_vectors(start, corners), face_area_vectors(moved, corners)
        size, area = lengths(before), lengths(after)
        bad = np.einsum("ij,ij->i", before, after) < _TURN * size * area
        bad |= area * _squared_sides(start, corners) < _SHAPE * size * _squared_sides(moved, corners)
        bad &= share.take(corners).max(axis=1) > 0
        judged = halve(share, faces, judged[bad])


def halve(share: Floats, faces: Ints, bad: Ints) -> Ints:
    """Halve the shares of these faces' corners, in place, and return the faces around them."""
    corners = np.unique(faces.take(bad, axis=0))
    share[corners] = np.where(share[corners] > 0.5**HALVINGS, share[corners] / 2, 0)
    touched = np.zeros(len(share), bool)
    touched[corners] = True
    return np.flatnonzero(touched.take(faces).any(axis=1))


def _squared_sides(vertices: Floats, faces: Ints) -> Floats:
    """Return the sum of each face's squared edges."""
    a, b, c = (vertices.take(faces[:, corner], axis=0) for corner in range(3))
    return ((b - a) ** 2).sum(axis=1) + ((c - b) ** 2).sum(axis=1) + ((a - c) ** 2).sum(axis=1)
