# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch of splits as symbols: who splits, how long the arc is, where it starts, what opens, where the vertex is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.adjacency import sorting_order
from ..core.mesh import Bools, Ints
from .coder import Reader, Writer
from .errors import StreamError
from .fans import Fans, fans_at
from .geometry import Grid, Shape, code_positions, place_of
from .models import Model
from .splits import Arcs, openings, walk

_ESCAPE = 15
_LEAVES = "the stream is damaged: a split leaves the surface; fetch the file again"


class Mesh:
    """The mesh on its way up; arrays have room for the whole, their rows side by side.

    All begin as zeros: room for counts that damage has made large costs no memory until something is there.

    Attributes
    ----------
    numbers, points : ndarray, (3, n) int64
        Coordinates as they are written, and on the grid of predictions.
    short : ndarray, (3, n) int64
        Points without the bits that scores do not look at.
    faces : ndarray, (3, m) int64
    parents : ndarray, (n,) int64
        The vertex that each was split from, -1 in the base.
    degree : ndarray, (n,) int64
        Corners at each vertex.
    vertex_count, face_count : int
        How many of them are there.
    """

    def __init__(self, grid: Grid, vertices: int, faces: int) -> None:
        self.grid = grid
        self.numbers = np.zeros((3, vertices), np.int64)
        self.points = self.numbers if grid.kind != 2 else np.zeros((3, vertices), np.int64)
        self.short = self.points if grid.shift == 0 else np.zeros((3, vertices), np.int64)
        self.faces = np.zeros((3, faces), np.int64)
        self.parents = np.zeros(vertices, np.int64)
        self.degree = np.zeros(vertices, np.int64)
        self.vertex_count = self.face_count = 0

    def place(self, numbers: Ints) -> None:
        """Add vertices at (3, k) numbers."""
        new = slice(self.vertex_count, self.vertex_count + numbers.shape[1])
        self.numbers[:, new] = numbers
        if self.points is not self.numbers:
            self.points[:, new] = self.grid.predictors(numbers)
        if self.short is not self.points:
            self.short[:, new] = self.points[:, new] >> self.grid.shift
        self.vertex_count = new.stop


@dataclass(frozen=True)
class Splits:
    """A batch in the stream's numbers: (k,) arrays.

    Attributes
    ----------
    vertex : ndarray
        The vertices that split, ascending.
    start : ndarray
        Corners as row * faces + face.
    length : ndarray
    third : ndarray, (2, k)
        Third corners of the new faces, -1 where there is none.
    numbers : ndarray, (3, k)
    """

    vertex: Ints
    start: Ints
    length: Ints
    third: Ints
    numbers: Ints


@dataclass(frozen=True)
class Done:
    """What a batch changed: slots of corners that moved, and the count of faces after each split."""

    split: Ints
    slot: Ints  # row * faces before + face
    start: Ints  # slots where the arcs start
    there: Bools


class Connectivity:
    """Adaptive models of who splits, and how."""

    def __init__(self) -> None:
        self.flag = Model(64, 2)
        self.length = Model(16, 16)
        self.start = Model(128, 16)
        self.sides = Model(3, 4)
        self.torn = Model(2, 2)


def code_batch(coder: Writer | Reader, models: Connectivity, shape: Shape, mesh: Mesh, known: Splits | None) -> Done:
    """Write a batch, or read it, and carry it out on the mesh."""
    count = mesh.vertex_count
    vertex = _code_flags(coder, models, mesh, known)
    splits = len(vertex)
    chosen = np.zeros(count, bool)
    chosen[vertex] = True
    label = np.zeros(count, np.int64)
    label[vertex] = np.arange(splits)
    fans = fans_at(mesh.faces[:, : mesh.face_count], chosen)
    degree = mesh.degree.take(vertex)
    length = _code_small(coder, models.length, np.minimum(degree, 15), None if known is None else known.length)
    if (length > degree).any():
        raise StreamError(_LEAVES)
    start = _code_start(coder, models.start, mesh, fans, label.take(fans.vertex), degree, vertex, length, known)
    arcs = walk(fans, start, length)
    if not arcs.whole.all():
        raise StreamError(_LEAVES)
    there = _code_sides(coder, models.sides, fans, start, length, arcs, known)
    new = count + np.arange(splits)
    slot = fans.slot.take(arcs.corner)
    row, face = np.divmod(slot, max(mesh.face_count, 1))
    mesh.faces[row, face] = new.take(arcs.split)
    found = openings(fans, arcs, chosen, vertex, start, there, mesh.faces[:, : mesh.face_count])
    third = found.third
    at, partner = found.torn_at, found.partner
    if len(at):
        first = np.flatnonzero(np.arange(len(at)) <= partner)
        diagonal = np.zeros(len(at), bool)
        if known is not None:
            diagonal = found.upper_of(known.third.ravel().take(at) >= count)
        diagonal[first] = coder.symbols(models.torn, first * 0, diagonal.take(first).astype(np.int64)) == 1
        diagonal = diagonal.take(np.minimum(partner, np.arange(len(at))))
        ring = third.ravel().take(at)
        third.ravel()[at] = np.where(found.upper_of(diagonal), new.take(label.take(ring)), ring)
    numbers = code_positions(coder, shape, mesh.grid, mesh.points, fans, arcs, vertex,
                             None if known is None else known.numbers)
    _carry_out(mesh, vertex, arcs, there, third, numbers)
    return Done(arcs.split, slot, fans.slot.take(start), there)


def _code_flags(coder: Writer | Reader, models: Connectivity, mesh: Mesh, known: Splits | None) -> Ints:
    degree = mesh.degree[: mesh.vertex_count]
    able = np.flatnonzero(degree)
    context = np.minimum(degree.take(able), 20)
    flags = None
    if known is not None:
        marked = np.zeros(mesh.vertex_count, np.int64)
        marked[known.vertex] = 1
        flags = marked.take(able)
    return able.take(np.flatnonzero(coder.symbols(models.flag, context, flags)))


def _code_small(coder: Writer | Reader, model: Model, context: Ints, known: Ints | None) -> Ints:
    """Code numbers that are mostly below 15; the others follow as plain bits."""
    symbol = coder.symbols(model, context, None if known is None else np.minimum(known, _ESCAPE))
    large = np.flatnonzero(symbol == _ESCAPE)
    if len(large) == 0:
        return symbol
    rest = coder.bits(np.full(len(large), 32), None if known is None else known.take(large))
    values = symbol.copy()
    values[large] = rest
    return values


def _code_start(coder: Writer | Reader, model: Model, mesh: Mesh, fans: Fans, own: Ints, degree: Ints, vertex: Ints,
                length: Ints, known: Splits | None) -> Ints:
    """Code at which corner each arc starts, as its place in an order by likelihood."""
    corners, splits = len(own), len(vertex)
    toward = np.zeros(corners, np.int64)
    for axis in mesh.short:
        off = axis.take(fans.following)
        off += axis.take(fans.preceding)
        off -= (2 * axis.take(vertex)).take(own)
        pull = np.bincount(own, off, splits).astype(np.int64)
        off *= (pull // degree).take(own)
        toward += off
    window, step = toward.copy(), 1
    steps = np.minimum(length, 8).take(own)
    left = np.flatnonzero(steps > step)
    onward = left
    while len(left):
        onward = fans.successor.take(onward)
        if onward.min() < 0:  # at the end of an open fan
            there = np.flatnonzero(onward >= 0)
            left, onward = left.take(there), onward.take(there)
        window[left] += toward.take(onward)
        step += 1
        further = np.flatnonzero(steps.take(left) > step)
        left, onward = left.take(further), onward.take(further)
    # by likelihood in single precision, equal ones in the order of the corners' slots; then by split
    order = sorting_order(place_of(-window) + (1 << 31))
    order = order.take(sorting_order(own.take(order)))
    begin = np.cumsum(degree) - degree
    rank = None
    context = np.minimum(degree, 15) * 8 + np.minimum(length, 7)
    if known is not None:
        place = np.empty(3 * mesh.face_count, np.int64)
        place[fans.slot] = np.arange(corners)
        inverse = np.empty(corners, np.int64)
        inverse[order] = np.arange(corners)
        rank = inverse.take(place.take(known.start)) - begin
    rank = _code_small(coder, model, context, rank)
    if len(rank) and (rank >= degree).any():
        raise StreamError("the stream is damaged: a split starts at no corner; fetch the file again")
    return order.take(begin + rank) if corners else np.zeros(0, np.int64)


def _code_sides(coder: Writer | Reader, model: Model, fans: Fans, start: Ints, length: Ints, arcs: Arcs,
                known: Splits | None) -> Bools:
    """Code which of the two new faces are there; at both inside a surface, so only the fans' ends need symbols."""
    there = np.ones((2, len(start)), bool)
    at_first = fans.predecessor.take(start) < 0
    at_last = fans.successor.take(arcs.last) < 0
    bare = length == 0
    asked = np.flatnonzero(at_first | at_last | bare)
    context = np.where(bare.take(asked), 2, (at_first & at_last).take(asked).astype(np.int64))
    symbol = None
    if known is not None:
        symbol = (known.third.take(asked, axis=1) >= 0).astype(np.int64)
        symbol = symbol[0] + 2 * symbol[1]
    symbol = coder.symbols(model, context, symbol)
    there[0, asked], there[1, asked] = symbol & 1, symbol >> 1
    if not there.any(axis=0).all():
        raise StreamError("the stream is damaged: a split opens no face; fetch the file again")
    arcs.settle(np.flatnonzero(bare), there[0])
    return there


def _carry_out(mesh: Mesh, vertex: Ints, arcs: Arcs, there: Bools, third: Ints, numbers: Ints) -> None:
    count, splits = mesh.vertex_count, len(vertex)
    new = count + np.arange(splits)
    both = there.sum(axis=0)
    opened = int(both.sum())
    if count + splits > mesh.numbers.shape[1] or mesh.face_count + opened > mesh.faces.shape[1]:
        raise StreamError("the stream is damaged: a batch holds more than its table says; fetch the file again")
    place = mesh.face_count + np.cumsum(both) - both
    for which, (first, second) in enumerate(((new, vertex), (vertex, new))):
        own = np.flatnonzero(there[which])
        at = place.take(own) + (which == 1) * there[0].take(own)
        for row, corners in zip(mesh.faces, (first, second, third[which]), strict=True):
            row[at] = corners.take(own)
    moved = np.bincount(arcs.split, minlength=splits)
    mesh.degree[new] = both + moved
    mesh.degree[vertex] += both - moved
    mesh.degree[: count + splits] += np.bincount(third.ravel()[there.ravel()], minlength=count + splits)
    mesh.parents[new] = vertex
    mesh.place(numbers)
    mesh.face_count += opened
