# SPDX-License-Identifier: GPL-3.0-or-later
"""From the engine's record to finished meshes: a level in the input's numbers, refitted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .border_planes import into_planes
from .carrier import Carrier
from .closest import ClosestPoints
from .mesh import Floats, Ints
from .options import Options
from .prepare import Prepared
from .record import CollapseRecord
from .refit import Refitted, refit
from .reinsertion import spare_vertices, with_parts

Int32s = NDArray[np.int32]
Mesh = tuple[Floats, Ints]

# points on each surface where levels are compared
_PROBES = 8192


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
        The input face that each face comes from; of two whose edge has flipped, either; of one into which the refit
        has put a vertex back, the same for all its parts.
    reached : bool
        Whether the target was reached.
    messages : tuple of str
        What was mended, and why a target was not reached.
    record : CollapseRecord
        The run that made it, in the engine's numbers.
    attributes : dict of str to ndarray
        What was carried, on the new vertices, corners, faces and edges.
    edges : ndarray, (e, 2) int32
        The edges that attributes on edges belong to; none where there are no such attributes.
    """

    vertices: Floats
    faces: Int32s
    vertex_map: Int32s
    face_map: Int32s
    reached: bool
    messages: tuple[str, ...]
    record: CollapseRecord
    original: Mesh
    attributes: dict[str, NDArray] = field(default_factory=dict)
    edges: Int32s = field(default_factory=lambda: np.zeros((0, 2), np.int32))

    @cached_property
    def error(self) -> float:
        """Largest distance between both surfaces at thousands of probes, in the mesh's units; `measure` takes more."""
        if len(self.faces) == len(self.original[1]):
            return 0.0  # the mesh itself
        return Probes(self.original).deviation(self)


def in_input_units(record: CollapseRecord, mesh: Prepared, vertices: Floats) -> CollapseRecord:
    """Return the record with positions in the input's units; vertices that stayed have theirs to the last bit."""
    position = record.position * mesh.size + mesh.center
    still = record.stays
    position[still] = vertices[mesh.source[record.kept[still]]]
    return replace(record, position=position)


def level(mesh: Prepared, record: CollapseRecord, original: Mesh, length: int,
           options: Options, carrier: Carrier | None = None, spare: int = 0) -> SimplifyResult:
    """Build the mesh after so many collapses, refitted, in the input's numbers, with what the carrier puts on it.

    The refit may put `spare` vertices back.
    """
    vertices, faces = original
    given = vertices[mesh.source]
    points, corners, face_map, survivor = record.level(given, mesh.faces.T, length)
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
    held, borders = np.zeros((len(placed), 3), bool), _borders(mesh, options)
    if options.moves and length and borders.size:
        placed, held = into_planes(placed, corners, given.T, borders, merged)
    fitted = Refitted.unfitted(placed, corners)
    if options.refit and options.moves and length:
        # the engine's vertices stand for the input's, so that seams stay closed
        fitted = refit(
            placed, corners, given, mesh.faces.T, vertex_map=merged,
            fixed=held if carrier is None else held | carrier.held(merged, len(placed))[:, None],
            bound=None if carrier is None else carrier.bound(merged, len(placed)),
            group=_sheets(mesh, faces, face_map) if carrier is None else carrier.sheets(face_map),
            flips=options.flips and (carrier is None or carrier.flips), spare=spare,
            apart=mesh.opened if carrier is None else mesh.opened | carrier.marked,
            lines=borders if carrier is None else np.concatenate((borders, carrier.line_edges), axis=1))
    numbers = merged.copy()
    numbers[fitted.back] = len(placed) + np.arange(len(fitted.back))
    placed, corners, slots = fitted.vertices, fitted.faces, fitted.corner
    vertex_map = np.where(mesh.vertex >= 0, numbers.take(mesh.vertex, mode="clip"), -1)
    if carrier is not None:
        carried = carrier.carry(placed, corners, face_map, merged, fitted)
        messages = (*mesh.messages, *carrier.messages)
        return SimplifyResult(carried.points, carried.corners.astype(np.int32), carried.vertex_map.astype(np.int32),
                              carried.face_map.astype(np.int32), True, messages, record, original,
                              carried.attributes, carried.edges.astype(np.int32))
    before = mesh.face[face_map]
    face_map = with_parts(before, slots)
    if mesh.sheet is not None:
        before = faces[before].ravel().take(slots)
        placed, corners, vertex_map = _split(mesh.sheet, before, placed, corners, vertex_map)
    return SimplifyResult(placed, corners.astype(np.int32), vertex_map.astype(np.int32), face_map.astype(np.int32),
                          True, mesh.messages, record, original)


def spare_of(count: int, options: Options, carrier: Carrier | None) -> int:
    """Return how many vertices a refit may put back into a level of so many triangles."""
    if not (options.refit and options.moves and options.flips) or (carrier is not None and not carrier.reinserts):
        return 0
    return spare_vertices(count)


def _borders(mesh: Prepared, options: Options) -> Ints:
    """Return the engine's edges, (2, l) int64, of open borders that shall stay where they are."""
    return np.zeros((2, 0), np.int64) if options.boundary_lines == "ignored" else mesh.boundary_edges


def _sheets(mesh: Prepared, input_faces: Ints, face_map: Ints) -> Ints | None:
    """Return the connected part of the input that each of the engine's faces is in, None where the weld joined none."""
    return None if mesh.sheet is None else mesh.sheet.take(input_faces[mesh.face[face_map], 0])


def _split(sheet: Ints, input_corners: Ints, points: Floats, corners: Ints,
           vertex_map: Ints) -> tuple[Floats, Ints, Ints]:
    """Give each connected part of the input its own vertices again where the weld had joined them."""
    count = int(sheet.max(initial=0)) + 1
    keys, numbers = np.unique((corners * count + sheet.take(input_corners)).ravel(), return_inverse=True)
    wanted = vertex_map * count + sheet
    found = np.searchsorted(keys, wanted).clip(max=len(keys) - 1)
    there = (vertex_map >= 0) & (keys[found] == wanted)
    return points.take(keys // count, axis=0), numbers.reshape(corners.shape), np.where(there, found, -1)


def judge_count(result: SimplifyResult, target: int, options: Options) -> SimplifyResult:
    """Return the result, saying so where it stopped short of its target."""
    left = len(result.faces)
    if left <= target or target == 0:
        return result
    reason = ("losing a feature; lower epsilon to go on" if options.method == "feature" else
              "changing the topology; prune small parts to go on")
    message = f"stopped at {left} of {target} triangles: no further edge can go without {reason}"
    return replace(result, reached=False, messages=(*result.messages, message))


class Probes:
    """Points spread over an original, to bound the deviation of many levels quickly."""

    def __init__(self, original: Mesh) -> None:
        vertices, faces = original
        self.surface = ClosestPoints(vertices, faces)
        self.points = _thin(np.concatenate((vertices[np.unique(faces)], vertices[faces].mean(axis=1))))

    def deviation(self, level: SimplifyResult, enough: float | None = None) -> float:
        """Return the largest distance that the probes find, either way; where it is below `enough`, one below that."""
        corners = level.vertices[level.faces]
        middles = (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2
        points = _thin(np.concatenate((level.vertices, corners.mean(axis=1), middles)))
        _, _, forward = ClosestPoints(level.vertices, level.faces.astype(np.int64)).query(self.points, enough=enough)
        _, _, backward = self.surface.query(points, enough=enough)
        return float(np.sqrt(max(forward.max(initial=0.0), backward.max(initial=0.0))))


def _thin(points: Floats) -> Floats:
    return points[:: -(-len(points) // _PROBES) or 1]
