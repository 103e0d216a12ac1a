# SPDX-License-Identifier: GPL-3.0-or-later
"""The patches of a mesh in the order of the stream: base first, then batch after batch of splits."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.mesh import Floats, Ints
from ..core.steps import scaled
from .batch_codec import Splits
from .engine import endpoint_options, lines_of, prepared, run_engine, tangled
from .estimate import estimated_errors
from .history import Batch, Unwinding
from .polygons import is_apart
from .source import Source, distinct, rows_as_bytes

_ROUNDS = 12
# the engine runs again while each run leaves less than this part of the faces
_WORTHWHILE = 0.9


@dataclass
class Patches:
    """A progressive mesh; p places, m faces of the splits' mesh, r faces beside it, w wedges, v vertices.

    Attributes
    ----------
    places : ndarray, (p, 3) float32
    parents : ndarray, (p,) int64
        The place that each was split from, -1 in the base.
    faces : ndarray, (3, m) int64
        Corners of the finest mesh, as places.
    batches : list of Splits
    place_starts, face_starts : ndarray, (batches + 1,) int64
        Places and faces before each batch, and after all.
    extra : ndarray, (3, r) int64
        Faces that no split touches.
    wedge_starts : ndarray, (p + 1,) int64
    wedge_parents : ndarray, (w,) int64
        The wedge that each becomes where its place goes, -1 in the base.
    wedge_vertex : ndarray, (w,) int64
        The vertex of each wedge; ascending.
    corner_wedge, extra_wedge : ndarray, (3, m) and (3, r) int64
    edges : ndarray, (l, 2) int64
        Loose edges as vertices.
    columns : dict of list of ndarray
        Attributes by domain: of vertices, wedges, faces (extra ones first) and sides.
    errors : ndarray, (batches + 1,) float64
        Estimated deviation of the base, and after each batch.
    opened : ndarray, (p,) uint8
        Faces that open with each place.
    vertex_order, face_order, face_turn : ndarray or None
        The original's number of each vertex and face, and the column of each face's first corner.
    """

    places: np.ndarray
    parents: Ints
    faces: Ints
    batches: list[Splits]
    place_starts: Ints
    face_starts: Ints
    extra: Ints
    wedge_starts: Ints
    wedge_parents: Ints
    wedge_vertex: Ints
    corner_wedge: Ints
    extra_wedge: Ints
    turned: np.ndarray
    edges: Ints
    attributes: dict[str, dict[str, np.ndarray]]
    vertex_order: Ints | None
    face_order: Ints | None
    face_turn: np.ndarray | None
    errors: np.ndarray
    opened: np.ndarray

    @property
    def vertices(self) -> int:
        """Number of vertices of the finest mesh."""
        return int(self.wedge_vertex[-1]) + 1 if len(self.wedge_vertex) else 0


def make_patches(source: Source, target: int, options: dict[str, Any]) -> Generator[float, None, Patches]:
    """Simplify down to about `target` faces and number everything in the order of the stream."""
    chosen = endpoint_options(options)
    finite = np.isfinite(source.places).all(axis=1)
    able = np.flatnonzero(finite.take(source.faces).all(axis=1))
    points = np.where(finite[:, None], source.places, 0).astype(np.float64)
    mesh = prepared(points, source.faces.take(able, axis=0))
    if mesh is None:
        return _Numbering(source, None, np.zeros(0, np.int64), []).patches()
    faces = able.take(mesh.face)
    locked = np.zeros(len(points), bool)
    beside = np.ones(len(source.faces), bool)
    beside[faces] = False
    locked[source.faces[beside]] = True
    locked[source.vertex_place[source.edges]] = True
    corner = _corner_columns(mesh.turned, mesh.faces.shape[1])
    jumps = _Jumps(source, faces, corner)
    wedges = source.wedge.ravel().take(faces * 3 + corner)
    unwinding = Unwinding(points, mesh.source.take(mesh.faces), wedges)
    total = max(len(source.faces) - target, 1)
    batches: list[Batch] = []
    costs = np.zeros(len(points))
    for attempt in range(_ROUNDS):
        held, faces_before = int(unwinding.held.sum()), unwinding.faces.shape[1]
        if attempt:
            mesh = prepared(points, unwinding.faces.T)
            if mesh is None:
                break
        own = tangled(mesh.faces, mesh.opened) | (locked | unwinding.held).take(mesh.source)
        lines = jumps.lines(points, unwinding)
        run = run_engine(mesh, own, lines, chosen, target)
        record = yield from scaled(run, lambda left: min(max((len(source.faces) - left) / total, 0.0), 1.0))
        removed, kept = mesh.source.take(record.removed), mesh.source.take(record.kept)
        costs[removed] = record.cost
        batches += _carried_out(unwinding, removed, kept, record.batch_starts)
        # what holds the engine up costs it as much time again in every run
        if int(unwinding.held.sum()) == held or unwinding.faces.shape[1] > _WORTHWHILE * faces_before:
            break
        unwinding.frozen[:] = False
    numbering = _Numbering(source, unwinding, faces, batches[::-1], corner)
    patches = numbering.patches()
    patches.errors = estimated_errors(patches, costs.take(np.argsort(numbering.place)))
    return patches


def _carried_out(mesh: Unwinding, removed: Ints, kept: Ints, starts: Ints) -> Generator[Batch, None, None]:
    """Carry out the record's batches; what must wait in one of them goes with the next.

    Collapses without a common vertex may mostly change places: their splits do not depend on each other.
    """
    ends = np.append(starts[1:], len(removed))[: len(starts)]
    first = np.full(len(mesh.points), len(removed))
    waiting = np.zeros(0, np.int64)
    taken = 0
    while taken < len(ends) or len(waiting):
        if taken < len(ends):
            waiting = np.concatenate((waiting, np.arange(starts[taken], ends[taken])))
            taken += 1
        one, other = removed.take(waiting), kept.take(waiting)
        place = np.arange(len(waiting))
        # of several at a vertex the last one written stays: the first one
        first[np.stack((one, other), axis=1)[::-1].ravel()] = np.repeat(place[::-1], 2)
        free = (first.take(one) == place) & (first.take(other) == place)
        batch, late = mesh.collapse(one[free], other[free])
        if batch is not None:
            yield batch
        free[np.flatnonzero(free)[late]] = False
        waiting = waiting[~free]
    mesh.pack()


def _corner_columns(turned: np.ndarray | None, width: int) -> Ints:
    """Return which corner of its input face each engine's corner is: (3, m) int64."""
    columns = np.repeat(np.arange(3)[:, None], width, axis=1)
    if turned is not None:
        columns[1:, turned] = columns[:0:-1, turned]
    return columns


class _Jumps:
    """Where attributes jump between the faces of a mesh: UV, materials, and marks of edges."""

    def __init__(self, source: Source, faces: Ints, corner: Ints) -> None:
        named = source.attributes
        values = [array for array in named["corner"].values() if array.dtype == np.float32 and array.shape[2:] == (2,)]
        flat = [array.reshape(-1, 2) for array in values]
        kind = distinct(rows_as_bytes(dict(enumerate(flat)), 3 * len(source.faces)))
        # a vertex's wedges may differ in other attributes alone
        self._kind = kind.take(source.wedge_corner, mode="clip")
        self._starts = source.wedge_starts
        materials = named["face"].get("material_index")
        self._material = np.zeros(len(faces), np.int64) if materials is None else materials.take(faces).astype(np.int64)
        self._marks = np.zeros((3, len(faces)), bool)
        for name, array in named["side"].items():
            if array.dtype == bool and array.ndim == 2 and not is_apart(name):
                self._marks |= array.ravel().take(faces * 3 + corner)
        # a turned face's sides start one corner later
        turned = corner[1] != 1
        self._marks[:, turned] = np.roll(self._marks[:, turned], -1, axis=0)

    def lines(self, points: Floats, mesh: Unwinding) -> Ints:
        """Return the edges at which attributes jump, in a mesh on its way down."""
        kind = self._kind.take(self._starts.take(mesh.faces) + mesh.wedges)
        return lines_of(points, mesh.faces, kind, self._material.take(mesh.ids), self._marks.take(mesh.ids, axis=1))


class _Numbering:
    """Numbers places, faces, wedges and vertices from the base up."""

    def __init__(self, source: Source, mesh: Unwinding | None, faces: Ints, batches: list[Batch],
                 corner: Ints | None = None) -> None:
        self.source, self.batches, self.input_face = source, batches, faces
        self.corner = np.zeros((3, 0), np.int64) if corner is None else corner
        count, width = len(source.places), len(faces)
        self.place = np.full(count, -1)  # the stream's number of each place
        self.face = np.full(width, -1)
        self.turn = np.zeros(width, np.int64)  # the engine's row that is the stream's first
        self.splits: list[Splits] = []
        gone = np.zeros(count, bool)
        for batch in batches:
            gone[batch.new] = True
        base = np.flatnonzero(~gone)
        self.place[base] = np.arange(len(base))
        self.parents = [np.full(len(base), -1)]
        ids = np.zeros(0, np.int64) if mesh is None else mesh.ids
        rows = np.zeros((3, 0), np.int64) if mesh is None else self.place.take(mesh.faces)
        first = rows.argmin(axis=0) if rows.size else np.zeros(0, np.int64)
        sorted_faces = np.argsort(rows.min(axis=0), kind="stable") if rows.size else np.zeros(0, np.int64)
        self.face_ids = [ids.take(sorted_faces)]
        self.face[self.face_ids[0]] = np.arange(len(ids))
        self.turn[ids] = first
        self.places, self.width = len(base), len(ids)
        self.place_starts, self.face_starts = [self.places], [self.width]
        for batch in batches:
            self._number(batch)

    def _number(self, batch: Batch) -> None:
        old = self.place.take(batch.old)
        order = np.argsort(old, kind="stable")
        new, old = batch.new.take(order), old.take(order)
        opened, row = batch.opened.take(order, axis=1), batch.opened_row.take(order, axis=1)
        face, start_row = batch.start_face.take(order), batch.start_row.take(order)
        start = (start_row - self.turn.take(face)) % 3 * self.width + self.face.take(face)
        self.place[new] = self.places + np.arange(len(new))
        there = opened >= 0
        third = np.full(opened.shape, -1)
        # before = (new, old, third): its first row is the new vertex's; after = (old, new, third): the one before it
        for which in range(2):
            ids = opened[which, there[which]]
            self.turn[ids] = (row[which, there[which]] + 2 * which) % 3
        ids = opened.T.ravel()
        ids = ids[ids >= 0]
        self.face[ids] = self.width + np.arange(len(ids))
        self.face_ids.append(ids)
        self.pending = (there, opened)
        self.splits.append(Splits(old, start, batch.length.take(order), third, np.zeros((3, 0), np.int64)))
        self._fill_third(batch, order, new, third, there, opened)
        self.parents.append(old)
        self.places += len(new)
        self.width += len(ids)
        self.place_starts.append(self.places)
        self.face_starts.append(self.width)

    def _fill_third(self, batch: Batch, order: Ints, new: Ints, third: Ints, there: np.ndarray, opened: Ints) -> None:
        at = np.flatnonzero(there.ravel())
        third.ravel()[at] = self.place.take(batch.third.take(order, axis=1).ravel().take(at))

    def patches(self) -> Patches:
        source = self.source
        order = np.argsort(self.place)
        ids = np.concatenate(self.face_ids)
        counts = np.diff(source.wedge_starts).take(order)
        starts = np.concatenate(([0], np.cumsum(counts)))
        local = np.arange(starts[-1]) - np.repeat(starts[:-1], counts)
        wedges = np.repeat(source.wedge_starts[:-1].take(order), counts) + local
        old_vertex = source.wedge_vertex.take(wedges)
        new_vertex = np.ones(len(wedges), bool)
        new_vertex[1:] = old_vertex[1:] != old_vertex[:-1]
        rows = (self.turn.take(ids) + np.arange(3)[:, None]) % 3
        columns = np.take_along_axis(self.corner.take(ids, axis=1), rows, 0)
        input_face = self.input_face.take(ids)
        corners = input_face * 3 + columns
        beside = np.ones(len(source.faces), bool)
        beside[self.input_face] = False
        extra = np.flatnonzero(beside)
        extra = extra.take(np.argsort(self.place.take(source.faces.take(extra, axis=0)).min(axis=1), kind="stable")
                           if len(extra) else [])
        turned = ((columns[1] - columns[0]) % 3 == 2).astype(np.uint8)
        faces = self.place.take(source.faces.ravel().take(corners))
        beside_corner = extra * 3 + np.arange(3)[:, None]
        vertex_order = old_vertex[new_vertex]
        face_order = np.concatenate((extra, input_face))
        opened = np.concatenate([np.zeros(self.place_starts[0], np.uint8),
                                 *((splits.third >= 0).sum(axis=0).astype(np.uint8) for splits in self.splits)])
        result = Patches(
            source.places.take(order, axis=0), np.concatenate(self.parents), faces, self.splits,
            np.array(self.place_starts), np.array(self.face_starts),
            self.place.take(source.faces.ravel().take(beside_corner)), starts,
            self._wedge_parents(starts), np.cumsum(new_vertex) - 1,
            source.wedge.ravel().take(corners), source.wedge.ravel().take(beside_corner), turned,
            np.zeros((0, 2), np.int64), {}, vertex_order, face_order,
            np.concatenate((np.zeros(len(extra), np.int64), np.argmin(columns, axis=0) if len(ids) else columns[0])),
            np.zeros(len(self.splits) + 1), opened)
        number = np.zeros(len(vertex_order), np.int64)
        number[vertex_order] = np.arange(len(vertex_order))
        edges = np.sort(number.take(source.edges), axis=1)
        edge_order = np.lexsort((edges[:, 1], edges[:, 0]))
        result.edges = edges[edge_order]
        all_corners = np.concatenate((beside_corner, corners), axis=1)
        corner_of = source.wedge_corner.take(wedges)
        for domain, named in source.attributes.items():
            orders = {"vertex": vertex_order, "face": face_order, "edge": edge_order}
            result.attributes[domain] = {
                name: array[orders[domain]] if domain in orders else _of_corners(domain, array, corner_of, all_corners)
                for name, array in named.items()}
        return result

    def _wedge_parents(self, starts: Ints) -> Ints:
        """Return what each wedge becomes: the wedge that a fallen face joins to it, else the first that falls."""
        if starts[-1] == len(starts) - 1:  # one at each place
            return np.concatenate(self.parents)
        parents = np.full(starts[-1], -1)
        for batch, splits, first in zip(self.batches, self.splits, self.place_starts, strict=False):
            order = np.argsort(self.place.take(batch.new), kind="stable")
            opened_wedge = batch.opened_wedge.take(order, axis=2)
            row, opened = batch.opened_row.take(order, axis=1), batch.opened.take(order, axis=1)
            count = len(order)
            begin, end = starts[first], starts[first + count]
            split = np.repeat(np.arange(count), np.diff(starts[first : first + count + 1]))
            local = np.arange(begin, end) - starts.take(first + split)
            merged, known = np.zeros(end - begin, np.int64), np.zeros(end - begin, bool)
            for same in (True, False):
                for which in range(2):
                    at_new = opened_wedge[row[which], which, np.arange(count)].take(split)
                    at_old = opened_wedge[(row[which] + 1 + which) % 3, which, np.arange(count)].take(split)
                    fits = ~known & (opened[which].take(split) >= 0)
                    if same:
                        fits &= at_new == local
                    merged[fits] = at_old[fits]
                    known |= fits
            parents[begin:end] = merged + starts.take(splits.vertex.take(split))
        return parents


def _of_corners(domain: str, array: np.ndarray, wedge_corner: Ints, corners: Ints) -> np.ndarray:
    """Put an attribute in the stream's order: corners' by wedge, sides' as rows of three."""
    flat = array.reshape(-1, *array.shape[2:])
    if domain == "side":
        return flat[corners.T]
    if len(flat) == 0:
        return np.zeros((len(wedge_corner), *flat.shape[1:]), flat.dtype)
    values = flat[wedge_corner.clip(min=0)]
    values[wedge_corner < 0] = 0
    return values
