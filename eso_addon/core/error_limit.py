# SPDX-License-Identifier: GPL-3.0-or-later
"""The coarsest level within a largest distance from the original: sought by probes, promised by a thorough look.

The engine's costs are no distances, so each level that comes into question is measured. How far the promise holds:
docs/decisions/max-error.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .carrier import Carrier
from .closest import ClosestPoints
from .levels import Mesh, Probes, SimplifyResult, level, spare_of
from .mesh import Floats, Ints
from .normals import face_areas
from .options import Options
from .prepare import Prepared
from .record import CollapseRecord
from .sampling import edge_samples, face_samples

_SEED = 1
_SPREAD = 100_000  # points over the faces of each surface, and half as many along the edges
_FEW = 10  # one of so many of these is looked up first: most levels that are beyond the limit fail by them
_LITTLE = 0.5  # of the limit: how far nearer points are is not asked
_NEAR = 0.8  # faces with a sample as far as this part of the farthest are looked at closely,
_CLOSELY = 400  # at most so many of them,
_STEPS = 12  # at points so many to a side
_SAFE = 0.98  # the part of the limit that a thorough look may find: what it misses is less than the rest
_USED = 0.8  # a level that uses this part of the limit is coarse enough
_AIM = 0.88  # the part that the guess after a fit aims at: distances go about with one over the triangles,
_SWING = 2.0  # but by so many times fewer at most
_STRIDE = 0.05  # more triangles after the first misfit, twice as many after each other: a maximum is mostly chance
_GUESSES = 8  # then halving goes on


def within(mesh: Prepared, record: CollapseRecord, original: Mesh, limit: float, options: Options,
           carrier: Carrier | None = None) -> SimplifyResult:
    """Find a long prefix of the record whose finished level stays within a limit.

    Either a large part of the limit is used, or one more collapse would break it.

    Parameters
    ----------
    mesh : Prepared
    record : CollapseRecord
    original : tuple of ndarray
        Vertices (n, 3) float64 and faces (m, 3) int64.
    limit : float
        Largest distance between both surfaces, either way, in the mesh's units.
    options : Options
    carrier : Carrier, optional
    """
    search = _Search(mesh, record, original, limit, options, carrier)
    low, high = 0, len(record) + 1  # fits; does not fit
    best, length, stride, guesses = search.at(0), search.first_guess(), _STRIDE, _GUESSES
    while high - low > 1:
        if not low < length < high:
            length = (low + high) // 2
        result = search.at(length)
        used = search.used(result)
        if used > _SAFE:
            high, times, stride = length, 1 + stride, 2 * stride
        else:
            low, best, times = length, result, max(used / _AIM, 1 / _SWING)
            if used >= _USED:
                break
        guesses -= 1
        length = record.length_for(round(times * record.left(length))) if guesses > 0 else 0
    return best


class _Search:
    """Levels of one record, judged by their distance."""

    def __init__(self, mesh: Prepared, record: CollapseRecord, original: Mesh, limit: float, options: Options,
                 carrier: Carrier | None) -> None:
        self.mesh, self.record, self.original, self.limit = mesh, record, original, limit
        self.options, self.carrier = options, carrier
        self.probes = Probes(original)
        vertices, faces = original
        faces = faces[face_areas(vertices, faces) > 0]
        self.closely = (vertices, faces)
        self.vertices = vertices.take(np.unique(faces), axis=0)
        self.spread, self.face = (_spread(vertices, faces) if len(faces) else (self.vertices, np.zeros(0, np.int64)))

    def at(self, length: int, *, plain: bool = False) -> SimplifyResult:
        """Return a level: finished, or without what takes time and moves it little."""
        if plain:
            return level(self.mesh, self.record, self.original, length, replace(self.options, refit=False))
        spare = spare_of(self.record.left(length), self.options, self.carrier)
        return level(self.mesh, self.record, self.original, length, self.options, self.carrier, spare)

    def first_guess(self) -> int:
        """Return where probes of unfinished levels point to."""
        low, high = 0, len(self.record)
        while low < high:
            middle = (low + high + 1) // 2
            if self.probes.deviation(self.at(middle, plain=True), self.limit) > self.limit:
                high = middle - 1
            else:
                low = middle
        return low

    def used(self, result: SimplifyResult) -> float:
        """Return the part of the limit that a level uses: of one beyond what is safe, any beyond that."""
        farthest = self._farthest(result)
        if self.limit > 0:
            return farthest / self.limit
        return np.inf if farthest > 0 else 1.0

    def _farthest(self, result: SimplifyResult) -> float:
        """Return the largest distance between both surfaces that a thorough look finds, or one beyond the limit.

        Where it is below half of the limit, any such distance.
        """
        vertices, faces = result.vertices, result.faces.astype(np.int64)
        faces = faces[face_areas(vertices, faces) > 0]
        if len(faces) == 0:
            return np.inf
        end = (_SAFE * min(self.limit, 1e150)) ** 2  # of a longer one there is no square
        there, back = ClosestPoints(vertices, faces), self.probes.surface
        corners = vertices.take(np.unique(faces), axis=0)
        worst, little = 0.0, _LITTLE * self.limit
        spread, face = _spread(vertices, faces)
        for search, points in ((there, self.probes.points), (back, corners), (there, self.vertices),
                               (there, self.spread[::_FEW]), (back, spread[::_FEW])):
            worst = max(worst, float(search.query(points, enough=little)[2].max(initial=0.0)))
            if worst > end:
                return float(np.sqrt(worst))
        for search, source, some, of in ((there, self.closely, self.spread, self.face),
                                         (back, (vertices, faces), spread, face)):
            squared = search.query(some, enough=little)[2]
            worst = max(worst, float(squared.max(initial=0.0)))
            if worst > end:
                break
            squared = search.query(_close_up(*source, squared[: len(of)], of, worst), enough=little)[2]
            worst = max(worst, float(squared.max(initial=0.0)))
        return float(np.sqrt(worst))


def _spread(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Return points over the faces and then along the edges, and the faces of the former."""
    rng = np.random.default_rng(_SEED)
    points, face, _ = face_samples(vertices, faces, _SPREAD, rng)
    return np.concatenate([points, edge_samples(vertices, faces, _SPREAD // 2, rng)]), face


def _close_up(vertices: Floats, faces: Ints, squared: Floats, face: Ints, worst: float) -> Floats:
    """Return points close together on the faces with the farthest samples."""
    far = np.flatnonzero(squared > _NEAR**2 * worst)
    far = far.take(np.argsort(-squared.take(far), kind="stable"))
    chosen = face.take(far)
    chosen = chosen.take(np.sort(np.unique(chosen, return_index=True)[1]))[:_CLOSELY]
    first, second = (x.ravel() for x in np.meshgrid(np.arange(_STEPS + 1), np.arange(_STEPS + 1)))
    inside = first + second <= _STEPS
    first, second = first[inside] / _STEPS, second[inside] / _STEPS
    corners = vertices.take(faces.take(chosen, axis=0), axis=0)
    weights = np.stack([1 - first - second, first, second], axis=1)
    return np.einsum("pc,fcx->fpx", weights, corners).reshape(-1, 3)
