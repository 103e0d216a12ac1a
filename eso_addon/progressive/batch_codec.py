# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch of splits as symbols: who splits, how long the arc is, where it starts, what opens, where the vertex is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.mesh import Bools, Ints
from .coder import Reader, Writer
from .errors import StreamError
from .fans import Fans, fans_at
from .geometry import Grid, Shape, code_positions, place_of
from .models import Model
from .splits import openings, walk

_ESCAPE = 15


@dataclass
class Mesh:
    """The mesh on its way up; arrays have room for the whole."""

    grid: Grid
    numbers: Ints  # (n, 3), coordinates as they are written
    points: Ints  # (n, 3), on the grid of predictions
    faces: Ints  # (3, m)
    parents: Ints  # (n,) the vertex that each was split from, -1 in the base
    vertex_count: int
    face_count: int


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
    numbers : ndarray, (k, 3)
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
    faces = mesh.faces[:, : mesh.face_count]
    vertex = _code_flags(coder, models, mesh, known)
    chosen = np.zeros(count, bool)
    chosen[vertex] = True
    fans = fans_at(faces, chosen)
    splits = len(vertex)
    label = np.full(count, -1)
    label[vertex] = np.arange(splits)
    own = label.take(fans.vertex)
    degree = np.bincount(own, minlength=splits)
    length = _code_small(coder, models.length, np.minimum(degree, 15), None if known is None else known.length)
    start = _code_start(coder, models.start, mesh, fans, own, degree, vertex, length, known)
    there = _code_sides(coder, models.sides, fans, start, length, known)
    arcs = walk(fans, start, length, there[0])
    new = count + np.arange(splits)
    slot = fans.slot.take(arcs.corner)
    moved = faces.copy()
    moved.ravel()[slot] = new.take(arcs.split)
    found = openings(fans, arcs, vertex, start, there, moved, count)
    third = found.third
    at, partner = found.torn_at, found.partner
    if len(at):
        first = np.flatnonzero(np.arange(len(at)) <= partner)
        diagonal = np.zeros(len(at), bool)
        if known is not None:
            diagonal = found.upper_of(known.third.ravel().take(at) >= count)
        diagonal[first] = coder.symbols(models.torn, first * 0, diagonal.take(first).astype(np.int64)) == 1
        diagonal = diagonal.take(np.minimum(partner, np.arange(len(at))))
        ring = label.take(third.ravel().take(at))
        third.ravel()[at] = np.where(found.upper_of(diagonal), new.take(ring), third.ravel().take(at))
    numbers = code_positions(coder, shape, mesh.grid, mesh.points[:count], fans, arcs, vertex,
                             None if known is None else known.numbers)
    _carry_out(mesh, moved, vertex, there, third, numbers)
    return Done(arcs.split, slot, fans.slot.take(start), there)


def _code_flags(coder: Writer | Reader, models: Connectivity, mesh: Mesh, known: Splits | None) -> Ints:
    count = mesh.vertex_count
    degree = np.bincount(mesh.faces[:, : mesh.face_count].ravel(), minlength=count)
    able = np.flatnonzero(degree)
    context = np.minimum(degree.take(able), 20)
    flags = None
    if known is not None:
        marked = np.zeros(count, np.int64)
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
    points, shift = mesh.points[: mesh.vertex_count], mesh.grid.shift
    corners, splits = len(own), len(vertex)
    short = [points[:, axis] >> shift for axis in range(3)]
    toward = np.zeros(corners, np.int64)
    for axis in range(3):
        center = short[axis].take(vertex)
        off = short[axis].take(fans.following) + short[axis].take(fans.preceding) - 2 * center.take(own)
        pull = np.bincount(own, off, splits).astype(np.int64)
        toward += (pull // np.maximum(degree, 1)).take(own) * off
    window = toward.copy()
    current, step = np.arange(corners), 1
    steps = np.minimum(length, 8).take(own)
    left = np.flatnonzero(steps > step)
    while len(left):
        onward = fans.successor.take(current.take(left))
        left, onward = left[onward >= 0], onward[onward >= 0]
        current[left] = onward
        window[left] += toward.take(onward)
        step += 1
        left = left[steps.take(left) > step]
    # one key sorts by split, then by likelihood in single precision; equal ones keep the order of the corners' slots
    order = np.argsort((own << 32) + place_of(-window), kind="stable")
    begin = np.cumsum(degree) - degree
    rank = None
    context = np.minimum(degree, 15) * 8 + np.minimum(length, 7)
    if known is not None:
        place = np.full(3 * mesh.face_count, -1)
        place[fans.slot] = np.arange(corners)
        inverse = np.empty(corners, np.int64)
        inverse[order] = np.arange(corners)
        rank = inverse.take(place.take(known.start)) - begin
    rank = _code_small(coder, model, context, rank)
    if len(rank) and (rank >= degree).any():
        raise StreamError("the stream is damaged: a split starts at no corner; fetch the file again")
    return order.take(begin + rank) if corners else np.zeros(0, np.int64)


def _code_sides(coder: Writer | Reader, model: Model, fans: Fans, start: Ints, length: Ints,
                known: Splits | None) -> Bools:
    """Code which of the two new faces are there; at both inside a surface, so only the fans' ends need symbols."""
    there = np.ones((2, len(start)), bool)
    last = start.copy()
    step = 1
    left = np.flatnonzero(length > 1)
    while len(left):
        onward = fans.successor.take(last.take(left))
        if onward.min() < 0 or step > len(fans.slot):
            raise StreamError("the stream is damaged: a split leaves the surface; fetch the file again")
        last[left] = onward
        step += 1
        left = left[length.take(left) > step]
    at_first = fans.predecessor.take(start) < 0
    at_last = fans.successor.take(last) < 0
    asked = np.flatnonzero(at_first | at_last | (length == 0))
    context = np.where(length.take(asked) == 0, 2, (at_first & at_last).take(asked).astype(np.int64))
    symbol = None
    if known is not None:
        symbol = (known.third.take(asked, axis=1) >= 0).astype(np.int64)
        symbol = symbol[0] + 2 * symbol[1]
    symbol = coder.symbols(model, context, symbol)
    there[0, asked], there[1, asked] = symbol & 1, symbol >> 1
    if not there.any(axis=0).all():
        raise StreamError("the stream is damaged: a split opens no face; fetch the file again")
    return there


def _carry_out(mesh: Mesh, moved: Ints, vertex: Ints, there: Bools, third: Ints, numbers: Ints) -> None:
    count, splits = mesh.vertex_count, len(vertex)
    new = count + np.arange(splits)
    opened = int(there.sum())
    if count + splits > len(mesh.points) or mesh.face_count + opened > mesh.faces.shape[1]:
        raise StreamError("the stream is damaged: a batch holds more than its table says; fetch the file again")
    mesh.faces[:, : mesh.face_count] = moved
    both = there.sum(axis=0)
    place = mesh.face_count + np.cumsum(both) - both
    for which, (first, second) in enumerate(((new, vertex), (vertex, new))):
        own = there[which]
        at = (place + (which == 1) * there[0])[own]
        mesh.faces[:, at] = np.stack((first[own], second[own], third[which][own]))
    mesh.numbers[count : count + splits] = numbers
    mesh.points[count : count + splits] = mesh.grid.predictors(numbers)
    mesh.parents[count : count + splits] = vertex
    mesh.vertex_count += splits
    mesh.face_count += opened
