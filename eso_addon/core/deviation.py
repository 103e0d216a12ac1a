# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a simplified mesh is from its original: sampled distances in both directions, as Metro reports them."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .adjacency import face_neighbors
from .closest import ClosestPoints
from .mesh import MeshError, check_mesh, weld
from .normals import face_area_vectors, lengths
from .sampling import edge_samples, face_samples
from .steps import run_to_end, scaled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SAMPLES = 100_000  # samples over the faces, each way: the mean is then steady to about 1 %
_TIE = 1e-9  # closest points this near to an edge, relative to the diagonal, lie on both of its faces


@dataclass(frozen=True)
class OneWay:
    """Distances from samples of one surface to the other surface.

    `maximum` is over all samples, vertices and edges included; `mean` and `rms` are over samples spread evenly by area.
    `normal` is the mean angle in degrees between the normals at such a sample and at its closest point.
    """

    maximum: float
    mean: float
    rms: float
    normal: float


@dataclass(frozen=True)
class Deviation:
    """Deviation between an original and a simplified mesh, in the units of the meshes.

    `forward` goes from the original to the simplified mesh, `backward` the other way; `symmetric` holds the larger of
    both, and the mean of both for the normal; `diagonal` is that of the original's bounding box.
    """

    forward: OneWay
    backward: OneWay
    symmetric: OneWay
    diagonal: float

    def to_dict(self) -> dict[str, float | dict[str, float]]:
        """Return plain numbers in nested dictionaries, ready for JSON."""
        return asdict(self)


def measure(
    v0: ArrayLike,
    f0: ArrayLike,
    v1: ArrayLike,
    f1: ArrayLike,
    *,
    samples: int | None = None,
    seed: int = 0,
) -> Deviation:
    """Measure the deviation between two triangle meshes.

    Each surface is sampled evenly by area, at its vertices and along its edges, and the exact closest points on the
    other are found (Cignoni, Rocchini, Scopigno 1998, Metro: measuring error on simplified surfaces).

    Parameters
    ----------
    v0, f0
        The original: (n, 3) floats and (m, 3) integers.
    v1, f1
        The simplified mesh.
    samples
        Samples over the faces in each direction; 100,000 by default. Half as many more go along the edges.
    seed
        Of the random generator; the same seed gives the same figures.

    Returns
    -------
    Deviation
        Distances in the units of the meshes, normals in degrees. Normals are compared with their sign: surfaces back to
        back differ by 180 degrees. Where the closest point lies on an edge, the normal of the face that agrees
        better counts.

    Raises
    ------
    MeshError
        A mesh is malformed, not finite, or has no face with an area.
    """
    steps = measure_steps(v0, f0, v1, f1, samples=samples, seed=seed)
    return run_to_end(steps)


def measure_steps(
    v0: ArrayLike,
    f0: ArrayLike,
    v1: ArrayLike,
    f1: ArrayLike,
    *,
    samples: int | None = None,
    seed: int = 0,
) -> Generator[float, None, Deviation]:
    """Do what `measure` does in steps: yields progress from 0 to 1, returns the deviation, may be closed."""
    if samples is not None and samples < 1:
        raise MeshError(f"samples must be at least 1, not {samples}")
    count = _SAMPLES if samples is None else int(samples)
    original, simplified = _Surface.of(v0, f0, "original"), _Surface.of(v1, f1, "simplified")
    corners = original.vertices.take(original.faces.ravel(), axis=0)
    diagonal = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))
    rng = np.random.default_rng(seed)
    yield 0.02
    forward = yield from _one_way(original, simplified, count, rng, _TIE * diagonal, 0.02)
    backward = yield from _one_way(simplified, original, count, rng, _TIE * diagonal, 0.51)
    symmetric = OneWay(
        maximum=max(forward.maximum, backward.maximum),
        mean=max(forward.mean, backward.mean),
        rms=max(forward.rms, backward.rms),
        normal=(forward.normal + backward.normal) / 2,
    )
    return Deviation(forward, backward, symmetric, diagonal)


@dataclass(frozen=True)
class _Surface:
    """A mesh without its zero-area faces, equal positions welded."""

    vertices: Floats
    faces: Ints
    normals: Floats

    @classmethod
    def of(cls, vertices: ArrayLike, faces: ArrayLike, name: str) -> _Surface:
        """Check and clean a mesh, or say what is wrong with it."""
        points, corners = check_mesh(vertices, faces)
        corners = weld(points).take(corners)
        vectors = face_area_vectors(points, corners)
        areas = lengths(vectors)
        good = areas > 0
        if not good.any():
            raise MeshError(f"the {name} mesh has no surface to measure: it needs a triangle with an area")
        return cls(points, corners[good], vectors[good] / areas[good, None])


def _one_way(
    source: _Surface, target: _Surface, count: int, rng: np.random.Generator, tie: float, begun: float
) -> Generator[float, None, OneWay]:
    """Measure from samples of the source to the target; yields progress from what was begun with, to 0.49 more."""
    corners = source.vertices.take(np.unique(source.faces), axis=0)
    points, face, _ = face_samples(source.vertices, source.faces, count, rng)
    edges = edge_samples(source.vertices, source.faces, max(count // 2, 1), rng)
    yield begun
    search = ClosestPoints(target.vertices, target.faces)
    answers = []
    for number, queried in enumerate((corners, edges, points)):
        part = begun + 0.49 * (number + 0.5) / 3
        answers.append((yield from scaled(search.query_steps(queried), lambda _, part=part: part)))
    closest, hit, squared = answers[2]
    farthest = max(answer[2].max() for answer in answers[:2])
    cosine = _best_cosine(source.normals.take(face, axis=0), closest, hit, target, tie)
    return OneWay(
        maximum=float(np.sqrt(max(squared.max(), farthest))),
        mean=float(np.sqrt(squared).mean()),
        rms=float(np.sqrt(squared.mean())),
        normal=float(np.degrees(np.arccos(cosine.clip(-1, 1))).mean()),
    )


def _best_cosine(normal: Floats, closest: Floats, hit: Ints, target: _Surface, tie: float) -> Floats:
    """Return the cosines between the samples' normals and those of the faces hit.

    Where a closest point lies on an edge the choice between its faces hangs on rounding: the better one counts.
    """
    cosine = np.einsum("ij,ij->i", normal, target.normals.take(hit, axis=0))
    neighbors = face_neighbors(target.faces, len(target.vertices))
    corners = target.faces.take(hit, axis=0)
    for side in range(3):
        start = target.vertices.take(corners[:, side], axis=0)
        along = target.vertices.take(corners[:, (side + 1) % 3], axis=0) - start
        off = np.cross(along, closest - start)
        on_edge = np.einsum("ij,ij->i", off, off) <= tie**2 * np.einsum("ij,ij->i", along, along)
        rows = np.flatnonzero(on_edge)
        across = target.normals.take(neighbors[side].take(hit.take(rows)), axis=0)
        cosine[rows] = np.maximum(cosine[rows], np.einsum("ij,ij->i", normal[rows], across))
    return cosine
