# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify a mesh, or make all levels of an LOD chain in one run: options, targets, results."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .blocks import Blocks
from .closest import ClosestPoints
from .collapse import Rules, collapse_steps
from .deviation import measure
from .manifold import boundary_sides
from .mesh import Floats, Ints, MeshError, check_mesh
from .prepare import Prepared, prepare
from .quadrics import anchored, area_normals, boundary_quadrics, plane_quadrics
from .record import CollapseRecord
from .refit import refit as fit
from .variation import METHODS, surface_variation

Int32s = NDArray[np.int32]
Value = TypeVar("Value")

_PROBES = 8192
# a maximum error is sought with probes until this part of it is used; more of them may find a little more
_MARGIN = 0.9
_ENOUGH = 0.75


@dataclass(frozen=True)
class Options:
    """How to simplify; the defaults are the best that was measured.

    Attributes
    ----------
    method : str
        Vertex weights: "eso" (Equation 8), "so" (Equation 7), "qem" (none), or "cf" (edge factor of Equation 5).
    rings : int
        Rings of "eso".
    placement : str
        "optimal", or "endpoint": half-edge collapse, survivors stay where they are.
    weight_power : float
        The weights enter the quadrics raised to this power.
    area_weighted : bool
        Weigh planes by their faces' areas; without it by one, as printed.
    boundary_weight : float
        Weight of the quadrics that hold open boundaries.
    memory, flip, share, spread, guard
        See `collapse.Rules`.
    weld : bool
        Treat vertices at equal positions as one, and hand them back split.
    prune : float
        Drop connected parts whose bounding box has a smaller diagonal, in the mesh's units.
    refit : bool
        Move the survivors afterwards so that the surface fits the original; only with optimal placement.
    threads : int, optional
        All processors, at most four, where not given. The result does not depend on it.
    """

    method: str = "eso"
    rings: int = 3
    placement: str = "optimal"
    weight_power: float = 0.5
    area_weighted: bool = True
    boundary_weight: float = 10.0
    memory: float = 1e-9
    flip: float = 0.5
    share: float = 0.4
    spread: float = 3.0
    guard: bool = True
    weld: bool = True
    prune: float = 0.0
    refit: bool = True
    threads: int | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise MeshError(f"unknown method {self.method!r}: choose one of {', '.join(METHODS)}")
        if self.placement not in ("optimal", "endpoint"):
            raise MeshError(f"unknown placement {self.placement!r}: choose optimal or endpoint")
        if int(self.rings) != self.rings or self.rings < 1:
            raise MeshError(f"rings is {self.rings}: give a whole number of at least 1")
        if not self.prune >= 0:
            raise MeshError(f"prune is {self.prune}: give a length of at least 0")


# the equations as printed: planes of weight one, weights once and to the first power, nothing held, edges only
PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "paper": {"weight_power": 1.0, "area_weighted": False, "boundary_weight": 0.0, "memory": 1e-9, "flip": 0.2,
              "share": 0.05,
              "guard": False, "refit": False},
}


@dataclass(frozen=True)
class SimplifyResult:
    """A simplified mesh.

    Attributes
    ----------
    vertices : ndarray, (k, 3) float64
    faces : ndarray, (m, 3) int32
    vertex_map : ndarray, (n,) int32
        The vertex that each input vertex has become, -1 if it is gone.
    face_map : ndarray, (m,) int32
        The input face that each face comes from.
    reached : bool
        Whether the target was reached.
    messages : tuple of str
        What was mended, and why a target was not reached.
    record : CollapseRecord
        The run that made it, in the engine's numbers.
    """

    vertices: Floats
    faces: Int32s
    vertex_map: Int32s
    face_map: Int32s
    reached: bool
    messages: tuple[str, ...]
    record: CollapseRecord
    original: tuple[Floats, Ints]

    @cached_property
    def error(self) -> float:
        """Largest distance between both surfaces at some thousands of probes, in the mesh's units; `measure` takes more."""
        return _Probes(self.original).deviation(self)


def simplify(vertices: ArrayLike, faces: ArrayLike, *, ratio: float | None = None, faces_target: int | None = None,
             max_error: float | None = None, preset: str = "default", **options: Any) -> SimplifyResult:  # noqa: ANN401
    """Simplify a triangle mesh.

    Parameters
    ----------
    vertices : array_like, (n, 3)
    faces : array_like, (m, 3)
    ratio : float
        Part of the triangles to keep, above 0 and at most 1.
    faces_target : int
        Triangles to keep: reached exactly, or one below.
    max_error : float
        Largest distance between both surfaces, either way, in the mesh's units: the fewest triangles within it.
    preset : str
        "default", or "paper": Equations 8 and 9 as printed.
    **options
        Fields of `Options`; they override the preset's.

    Returns
    -------
    SimplifyResult

    Raises
    ------
    MeshError
        The mesh is not valid, or not exactly one target is given, or an option has no meaning.

    Examples
    --------
    >>> import eso_addon
    >>> result = eso_addon.simplify(vertices, faces, ratio=0.1)
    """
    return _finish(simplify_steps(vertices, faces, ratio=ratio, faces_target=faces_target, max_error=max_error,
                                  preset=preset, **options))


def simplify_steps(vertices: ArrayLike, faces: ArrayLike, *, ratio: float | None = None,
                   faces_target: int | None = None, max_error: float | None = None, preset: str = "default",
                   **options: Any) -> Generator[float, None, SimplifyResult]:  # noqa: ANN401
    """Do what `simplify` does step by step: yields progress from 0 to 1, returns the result, may be closed at any time."""
    levels = yield from lod_chain_steps(
        vertices, faces, ratios=None if ratio is None else [ratio],
        faces_targets=None if faces_target is None else [faces_target],
        max_errors=None if max_error is None else [max_error], preset=preset, **options)
    return levels[0]


def lod_chain(vertices: ArrayLike, faces: ArrayLike, ratios: Sequence[float] | None = None, *,
              faces_targets: Sequence[int] | None = None, max_errors: Sequence[float] | None = None,
              preset: str = "default", **options: Any) -> list[SimplifyResult]:  # noqa: ANN401
    """Make several levels of a mesh in one run of the engine.

    Parameters
    ----------
    vertices, faces, preset, **options
        As of `simplify`.
    ratios, faces_targets, max_errors : sequence
        One target a level, of one kind; see `simplify`.

    Returns
    -------
    list of SimplifyResult
        In the order of the targets. Levels are nested: before a refit, each is made of vertices of the finer ones.
    """
    return _finish(lod_chain_steps(vertices, faces, ratios, faces_targets=faces_targets, max_errors=max_errors,
                                   preset=preset, **options))


def lod_chain_steps(vertices: ArrayLike, faces: ArrayLike, ratios: Sequence[float] | None = None, *,
                    faces_targets: Sequence[int] | None = None, max_errors: Sequence[float] | None = None,
                    preset: str = "default",
                    **options: Any) -> Generator[float, None, list[SimplifyResult]]:  # noqa: ANN401
    """Do what `lod_chain` does step by step: yields progress from 0 to 1, returns the levels, may be closed any time."""
    chosen = _options(preset, options)
    original = check_mesh(vertices, faces)
    counts, errors = _targets(len(original[1]), ratios, faces_targets, max_errors)
    mesh = prepare(*original, join=chosen.weld, prune=chosen.prune)
    blocks = Blocks(chosen.threads)
    try:
        yield 0.02
        quadrics = _quadrics(mesh, chosen, blocks)
        yield 0.1
        rules = Rules(chosen.placement == "endpoint", chosen.memory, chosen.flip, chosen.guard, chosen.share,
                      chosen.spread, chosen.method == "cf")
        least = min(counts) if counts else 0
        run = collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, None, least, rules, blocks)
        total = max(mesh.faces.shape[1] - least, 1)
        record = yield from _scaled(run, lambda left: 0.1 + 0.7 * (1 - (left - least) / total))
    finally:
        blocks.close()
    record = _in_input_units(record, mesh, original[0])
    results = []
    for number in range(len(counts) + len(errors)):
        if counts:
            result = _level(mesh, record, original, record.length_for(counts[number]), chosen)
            result = _judge_count(result, counts[number])
        else:
            result = _within(mesh, record, original, errors[number], chosen)
        results.append(result)
        yield 0.8 + 0.2 * len(results) / (len(counts) + len(errors))
    return results


def _finish(steps: Generator[Any, None, Value]) -> Value:
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def _scaled(steps: Generator[int, None, Value], scale: Any) -> Generator[float, None, Value]:  # noqa: ANN401
    while True:
        try:
            yield scale(next(steps))
        except StopIteration as end:
            return end.value


def _options(preset: str, options: dict[str, Any]) -> Options:
    if preset not in PRESETS:
        raise MeshError(f"unknown preset {preset!r}: choose one of {', '.join(PRESETS)}")
    unknown = sorted(set(options) - set(Options.__dataclass_fields__))
    if unknown:
        raise MeshError(f"unknown option {unknown[0]!r}: choose from {', '.join(Options.__dataclass_fields__)}")
    return Options(**{**PRESETS[preset], **options})


def _targets(face_count: int, ratios: Sequence[float] | None, faces_targets: Sequence[int] | None,
             max_errors: Sequence[float] | None) -> tuple[list[int], list[float]]:
    """Return targets as counts of faces, or as errors."""
    given = [kind for kind in (ratios, faces_targets, max_errors) if kind is not None]
    if len(given) != 1 or len(given[0]) == 0:
        raise MeshError("give one target: ratio, faces_target or max_error")
    if ratios is not None:
        for ratio in ratios:
            if not 0 < ratio <= 1:
                raise MeshError(f"ratio is {ratio:g}: give a number above 0 and at most 1")
        return [max(round(face_count * ratio), 1) for ratio in ratios], []
    if faces_targets is not None:
        for count in faces_targets:
            if int(count) != count or count < 1:
                raise MeshError(f"faces_target is {count}: give a whole number of at least 1")
        return [int(count) for count in faces_targets], []
    assert max_errors is not None
    for error in max_errors:
        if not (error >= 0 and np.isfinite(error)):
            raise MeshError(f"max_error is {error}: give a length of at least 0")
    return [], [float(error) for error in max_errors]


def _quadrics(mesh: Prepared, options: Options, blocks: Blocks) -> Floats:
    """Weigh the mesh: Equation 9, and the planes that hold boundaries."""
    parts = plane_quadrics(mesh.points, mesh.faces, area_weighted=options.area_weighted)
    if options.boundary_weight > 0 and mesh.opened.any():
        sides = boundary_sides(mesh.faces, mesh.opened)
        normals, areas = area_normals(mesh.points, mesh.faces)
        face = sides % mesh.faces.shape[1]
        edges = np.stack((mesh.faces.ravel().take(sides), np.roll(mesh.faces, -1, axis=0).ravel().take(sides)))
        parts += boundary_quadrics(mesh.points, normals.take(face, axis=1) / np.maximum(areas.take(face), 1e-300),
                                   edges, options.boundary_weight)
    if options.method in ("so", "eso"):
        rings = 1 if options.method == "so" else int(options.rings)
        weights = surface_variation(mesh.points.T, mesh.faces.T, rings, blocks)
        mean = weights.mean()
        if mean > 0:
            parts *= np.maximum(weights / mean, 1e-6) ** options.weight_power
    return anchored(parts, mesh.points, options.memory)


def _in_input_units(record: CollapseRecord, mesh: Prepared, vertices: Floats) -> CollapseRecord:
    position = record.position * mesh.size + mesh.center
    still = record.stays
    position[still] = vertices[mesh.source[record.kept[still]]]  # to the last bit
    return replace(record, position=position)


def _level(mesh: Prepared, record: CollapseRecord, original: tuple[Floats, Ints], length: int,
           options: Options) -> SimplifyResult:
    """Build the mesh after so many collapses, refitted, in the input's numbers."""
    vertices, faces = original
    points, corners, face_map, survivor = record.level(vertices[mesh.source], mesh.faces.T, length)
    if mesh.turned is not None:
        turned = mesh.turned[face_map]
        corners[turned, 1:] = corners[turned, :0:-1]
    used = np.zeros(len(points), bool)
    used[corners] = True
    alive = np.flatnonzero(used)
    number = np.full(len(points), -1)
    number[alive] = np.arange(len(alive))
    corners, placed = number.take(corners), points.take(alive, axis=0)
    merged = number.take(survivor)  # of the engine's vertices
    vertex_map = np.where(mesh.vertex >= 0, merged.take(mesh.vertex, mode="clip"), -1)
    if options.refit and options.placement == "optimal" and length:
        # the engine's vertices stand for the input's, so that seams stay closed
        placed = fit(placed, corners, vertices[mesh.source], mesh.faces.T, vertex_map=merged)
    face_map = mesh.face[face_map]
    if mesh.sheet is not None:
        placed, corners, vertex_map = _split(mesh.sheet, faces[face_map], placed, corners, vertex_map)
    return SimplifyResult(placed, corners.astype(np.int32), vertex_map.astype(np.int32), face_map.astype(np.int32),
                          True, mesh.messages, record, original)


def _split(sheet: Ints, input_corners: Ints, points: Floats, corners: Ints,
           vertex_map: Ints) -> tuple[Floats, Ints, Ints]:
    """Give each connected part of the input its own vertices again where the weld had joined them."""
    count = int(sheet.max(initial=0)) + 1
    keys, numbers = np.unique((corners * count + sheet.take(input_corners)).ravel(), return_inverse=True)
    wanted = vertex_map * count + sheet
    found = np.searchsorted(keys, wanted).clip(max=len(keys) - 1)
    there = (vertex_map >= 0) & (keys[found] == wanted)
    return points.take(keys // count, axis=0), numbers.reshape(corners.shape), np.where(there, found, -1)


def _judge_count(result: SimplifyResult, target: int) -> SimplifyResult:
    left = len(result.faces)
    if left <= target:
        return result
    message = (f"stopped at {left} of {target} triangles: no further edge can go without changing the topology; "
               "prune small parts to go on")
    return replace(result, reached=False, messages=(*result.messages, message))


def _within(mesh: Prepared, record: CollapseRecord, original: tuple[Floats, Ints], limit: float,
            options: Options) -> SimplifyResult:
    """Find a long prefix of the record whose measured deviation stays within a limit.

    The costs are no distances, so the deviation is measured: with probes while the prefix is sought, and at the end as
    `measure` does it.
    """
    plain = replace(options, refit=False)
    probes = _Probes(original)
    low, high = 0, len(record)
    while low < high:
        middle = (low + high + 1) // 2
        deviation = probes.deviation(_level(mesh, record, original, middle, plain))
        if deviation > _MARGIN * limit:
            high = middle - 1
            continue
        low = middle
        if deviation > _ENOUGH * limit:
            break
    while low:
        for chosen in (options, plain) if options.refit else (plain,):
            result = _level(mesh, record, original, low, chosen)
            if measure(*original, result.vertices, result.faces).symmetric.maximum <= limit:
                return result
        low = max(low - (mesh.faces.shape[1] - low) // 20 - 1, 0)
    return _level(mesh, record, original, 0, plain)


class _Probes:
    """Points spread over an original, to bound the deviation of many levels quickly."""

    def __init__(self, original: tuple[Floats, Ints]) -> None:
        vertices, faces = original
        self.surface = ClosestPoints(vertices, faces)
        self.points = _thin(np.concatenate((vertices[np.unique(faces)], vertices[faces].mean(axis=1))))

    def deviation(self, level: SimplifyResult) -> float:
        corners = level.vertices[level.faces]
        middles = (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2
        points = _thin(np.concatenate((level.vertices, corners.mean(axis=1), middles)))
        _, _, forward = ClosestPoints(level.vertices, level.faces.astype(np.int64)).query(self.points)
        _, _, backward = self.surface.query(points)
        return float(np.sqrt(max(forward.max(initial=0.0), backward.max(initial=0.0))))


def _thin(points: Floats) -> Floats:
    return points[:: -(-len(points) // _PROBES) or 1]
