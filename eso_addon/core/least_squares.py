# SPDX-License-Identifier: GPL-3.0-or-later
"""The least squares of a refit: what vertices need so that given places of faces are, or have, what samples do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .normals import face_area_vectors, face_normals, lengths

Bools = NDArray[np.bool_]
Floats = NDArray[Any]  # float64, or float32 where only a choice hangs on it
Ints = NDArray[np.int64]

_DAMPING = 0.2  # pull towards the present position, relative to what evenly spread samples weigh
_ALONG = 0.1  # of a step along its face: the surface stays where it is, only the vertex slides
_TILT = 0.03  # weight of a tilt against the original's normal, times an edge, beside that of a distance
_AGREE = 0.5  # least cosine between a sample's normal and its face's for the tilt to count
_STEPS = 4  # of conjugate gradients: each round starts near the answer, more change nothing


class Samples(NamedTuple):
    """Samples of the original: (3, k) points in double and single precision, (k,) weights, (3, k) normals.

    The first v are vertices of it, (v,) these; their normals are zero: at a sharp edge they are no face's. The others
    are centres of its faces, (k - v,) these.
    """

    exact: Floats
    points: Floats
    weights: Floats
    normals: Floats
    vertex: Ints
    face: Ints


class Meeting(NamedTuple):
    """Where samples lie nearest to a surface: (k,) the face, (3, k) its corners' shares there, (k,) weights."""

    face: Ints
    places: Floats
    weights: Floats


class Equations:
    """The damped normal equations of values at vertices that are to be those of samples where these meet the faces.

    They are kept as one symmetric 3 by 3 block a face. Where the values are places, `normals`, (3, m), are those of the
    faces, zero for edges: steps along a face are held by a part only (Chen and Medioni 1992: point to plane).
    """

    def __init__(self, vertices: Floats, faces: Ints, met: Meeting, normals: Floats | None = None) -> None:
        self._corners, self._size, self._met = np.ascontiguousarray(faces.T), len(vertices), met
        self._normals = normals
        self._kept = 1 if normals is None else np.where(normals.any(axis=0), _ALONG, 1)
        self._heavy = met.weights * met.places
        self._blocks = {(i, j): self._sums(self._heavy[i] * met.places[j]) for i in range(3) for j in range(i, 3)}
        # evenly spread samples would put a sixth of a face's weight on the diagonal of each of its corners
        share = lengths(face_area_vectors(vertices, faces))
        share *= met.weights.sum() / (6 * max(float(share.sum()), 1e-300))
        self._damping = _DAMPING * self.gather([share] * 3) + 1e-9
        parts = np.ones((1, 1)) if normals is None else self._kept + (1 - self._kept) * normals * normals
        self.diagonal = np.stack([self._damping + self.gather([self._blocks[i, i] * part for i in range(3)])
                                  for part in parts])

    def _sums(self, values: Floats) -> Floats:
        return _sums(self._met.face, values, self._corners.shape[1])

    def gather(self, values: list[Floats]) -> Floats:
        """Return the sums over the faces around each vertex of values at the faces' corners."""
        return _gather(values, self._corners, self._size)

    def pull(self, values: Floats, wanted: Floats) -> Floats:
        """Return the right side, (c, k), for (c, k) values at the vertices and (c, s) that the samples have."""
        rows = []
        for row, goal in zip(values, wanted, strict=True):
            rest = goal.copy()
            for place, corner in zip(self._met.places, self._corners, strict=True):
                rest -= place * row.take(corner.take(self._met.face))
            rows.append(self.gather([self._sums(heavy * rest) for heavy in self._heavy]))
        return np.stack(rows)

    def times(self, step: Floats) -> Floats:
        """Return the matrix times a (c, k) step."""
        x, y, z = np.moveaxis(step.take(self._corners, axis=1), 1, 0)
        blocks = self._blocks
        held = np.stack([blocks[0, 0] * x + blocks[0, 1] * y + blocks[0, 2] * z,
                         blocks[0, 1] * x + blocks[1, 1] * y + blocks[1, 2] * z,
                         blocks[0, 2] * x + blocks[1, 2] * y + blocks[2, 2] * z], axis=1)
        if self._normals is not None:
            across = np.einsum("cf,cnf->nf", self._normals, held) * (1 - self._kept)
            held = self._kept * held + self._normals[:, None] * across
        return self._damping * step + np.stack([self.gather(list(row)) for row in held])

    def best_values(self, values: Floats, wanted: Floats, free: Bools) -> Floats:
        """Return (c, k) values that fit (c, s) of the samples, from `values` on; only those that are free change."""
        pull = self.pull(values, wanted) * free
        return values + _conjugate_gradients(lambda step: self.times(step) * free, pull, self.diagonal, axis=1)


def best_step(vertices: Floats, faces: Ints, samples: Samples, face: Ints, places: Floats) -> Floats:
    """Return the (k, 3) step that brings the points at `places` of their faces near to the samples, level with them."""
    normals = np.ascontiguousarray(face_normals(vertices, faces).T)
    equations = Equations(vertices, faces, Meeting(face, places, samples.weights), normals)
    columns, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    tilts = _tilts(normals, samples, face)
    pull = equations.pull(columns, samples.exact) - _tilt(tilts, columns, corners)
    rises = np.stack([equations.gather([2 * tilts[axis, axis]] * 3) for axis in range(3)])
    return _conjugate_gradients(lambda step: equations.times(step) + _tilt(tilts, step, corners), pull,
                                equations.diagonal + rises).T


def _tilts(own: Floats, samples: Samples, face: Ints) -> Floats:
    """Return (3, 3, m): outer products of the normals of each face's samples, where they agree with its, summed."""
    normals = samples.normals
    weights = np.where((own.take(face, axis=1) * normals).sum(axis=0) > _AGREE, _TILT * samples.weights, 0)
    sums = np.empty((3, *own.shape))
    for i in range(3):
        for j in range(i, 3):
            sums[i, j] = sums[j, i] = _sums(face, weights * normals[i] * normals[j], own.shape[1])
    return sums


def _tilt(tilts: Floats, columns: Floats, corners: Ints) -> Floats:
    """Return the gradient, (3, k), of how far the faces' edges rise along the samples' normals, squared and halved."""
    ends = [columns.take(corner, axis=1) for corner in corners]
    rises = [np.einsum("ijf,jf->if", tilts, ends[(corner + 1) % 3] - ends[corner]) for corner in range(3)]
    return np.stack(
        [
            _gather([rises[corner - 1][axis] - rises[corner][axis] for corner in range(3)], corners, columns.shape[1])
            for axis in range(3)
        ]
    )


def _gather(values: list[Floats], corners: Ints, count: int) -> Floats:
    """Return the sums over the faces around each vertex of values at the faces' corners."""
    return _sums(corners.ravel(), np.concatenate(values), count)


def _sums(index: Ints, values: Floats, count: int) -> Floats:
    """Return the sums of the values at each index."""
    return np.bincount(index, values, minlength=count).astype(np.float64, copy=False)


def _conjugate_gradients(apply: Callable[[Floats], Floats], right: Floats, diagonal: Floats,
                         axis: int | None = None) -> Floats:
    """Return about the solution of a positive definite system from zero on; with axis 1 each row is one of its own."""
    answer, rest = np.zeros_like(right), right.copy()
    scaled = rest / diagonal
    direction = scaled.copy()
    old = (rest * scaled).sum(axis=axis, keepdims=True)
    for _ in range(_STEPS):
        image = apply(direction)
        length = old / np.maximum((direction * image).sum(axis=axis, keepdims=True), 1e-300)
        answer += length * direction
        rest -= length * image
        scaled = rest / diagonal
        new = (rest * scaled).sum(axis=axis, keepdims=True)
        direction = scaled + new / np.maximum(old, 1e-300) * direction
        old = new
    return answer
