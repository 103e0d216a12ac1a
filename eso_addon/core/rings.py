# SPDX-License-Identifier: GPL-3.0-or-later
"""All pairs of vertices within so many rings of each other, block by block.

Sets of vertices are rows of bits. What lies within k + 1 rings of a vertex is the union of what lies within k
rings of its neighbours, so rings grow by gathering rows: nothing is sorted, and nothing is found twice.

A block of vertices is cut out of the mesh with all that it can reach, and cut into frames that do not see each
other, so that rows stay short while numpy's calls stay long. A vertex of the cutting is named by a key: its number
there plus the number of the frame times the number of vertices.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .adjacency import Bools, Ints

Bits = NDArray[np.uint64]

# Vertices a frame, a multiple of 64, and frames a block: one's rows, and one's pairs, should fit the second cache.
FRAME = 512
FRAMES = 4
# No way leads through a vertex of more neighbours than this: the rim of a fan of n faces would hold n * n pairs.
HUB = 1024
# Above this many neighbours a row is united on its own.
LONG_ROW = 64
# Words of 64 bits that the sets of one block may take; where they would take more, the columns come in parts.
MOST_WORDS = 1 << 22

WORD = np.dtype("<u8")
BIT_COUNTS = np.array([value.bit_count() for value in range(256)], dtype=np.float64)


class Pairs(NamedTuple):
    """Pairs of vertices, grouped by one end: `counts[i]` of `others` pair with `owners[i]`.

    Owners and others are places in `vertices`, where one vertex may stand several times.
    """

    vertices: Ints
    owners: Ints
    counts: Ints
    others: Ints


class _Graph(NamedTuple):
    """One-rings, where each begins among `neighbours` and how long it is; numbers for the keys at hand, else -1."""

    offsets: Ints
    neighbours: Ints
    counts: Ints
    row: Ints
    column: Ints

    def between(self, block: Ints) -> Ints:
        """Return the neighbours of consecutive vertices, one after the other."""
        return self.neighbours[self.offsets[block[0]] : self.offsets[block[-1]] + self.counts[block[-1]]]

    def rows_of(self, keys: Ints) -> Ints:
        """Return the keys of the neighbours of all these keys, one after the other."""
        shifts = keys // len(self.counts) * len(self.counts)
        vertices = keys - shifts
        counts = np.take(self.counts, vertices)
        places = np.repeat(np.take(self.offsets, vertices) - np.cumsum(counts) + counts, counts)
        places += np.arange(len(places))
        near = np.take(self.neighbours, places)
        near += np.repeat(shifts, counts)
        return near


class _Columns(NamedTuple):
    """The columns of a block: for each its key and its place in the rows of its frame; and where vertices stand."""

    keys: Ints
    places: Ints
    width: int
    vertices: Ints


def near_pairs(offsets: Ints, neighbours: Ints, rings: int) -> Iterator[Pairs]:
    """Find all pairs of vertices within so many rings of each other, each once.

    Parameters
    ----------
    offsets, neighbours : one-rings of n vertices as CSR; quick where neighbours have numbers close to each other
    rings : 1 or more

    Yields
    ------
    Pairs, none without any. No way of more than one step leads through a vertex of more than `HUB` neighbours.
    """
    count = len(offsets) - 1
    counts = np.diff(offsets)
    is_hub = counts > HUB
    hubs = np.flatnonzero(is_hub)
    around_hubs = [neighbours[offsets[hub] : offsets[hub + 1]] for hub in hubs]
    if len(hubs):
        neighbours = neighbours.compress(np.repeat(~is_hub, counts))
        counts[hubs] = 0
        offsets = np.concatenate(([0], np.cumsum(counts)))
    unused = np.zeros(0, dtype=np.int64)
    graph = _Graph(offsets, neighbours, counts, np.full(count, -1), unused)
    later = _later_bits(FRAME)
    for start in range(0, count, FRAME * FRAMES):
        block = np.arange(start, min(start + FRAME * FRAMES, count))
        vertices, cutting = _cut_out(graph, block, rings)
        first = int(np.searchsorted(vertices, start))
        for pairs in _block_pairs(cutting, first + block - start, is_hub[vertices], later, rings):
            yield pairs._replace(vertices=np.take(vertices, pairs.vertices))
    yield from _hub_pairs(graph, is_hub, around_hubs, rings)


def _cut_out(graph: _Graph, block: Ints, rings: int) -> tuple[Ints, _Graph]:
    """Return the vertices that a block can reach, ascending, and the one-rings of all but the last ring of them."""
    levels, around = _levels(graph, block, graph.between(block), rings)
    vertices = np.sort(np.concatenate(levels))
    graph.row[vertices] = np.arange(len(vertices))
    inner = np.concatenate(levels[:-1])
    own, lengths = np.take(graph.row, inner), np.take(graph.counts, inner)
    offsets, counts = np.zeros((2, len(vertices)), dtype=np.int64)
    offsets[own], counts[own] = np.cumsum(lengths) - lengths, lengths
    neighbours = np.take(graph.row, np.concatenate(around))
    graph.row[vertices] = -1
    return vertices, _Graph(offsets, neighbours, counts, *np.full((2, FRAMES * len(vertices)), -1))


def _block_pairs(graph: _Graph, block: Ints, is_hub: Bools, later: Bits, rings: int) -> Iterator[Pairs]:
    """Find the pairs of each frame's vertices with each other and with vertices of higher number."""
    count = len(graph.counts)
    start = int(block[0])
    frames = (block - start) // FRAME
    shifts = frames * count
    near = graph.between(block) + np.repeat(shifts, graph.counts[block])
    levels, around = _levels(graph, block + shifts, near, rings)
    columns = _columns(count, start, levels, is_hub)
    width = max(FRAME, MOST_WORDS // sum(map(len, levels)) * 64)
    for first in range(0, columns.width, width):
        here = columns.keys, columns.places
        if columns.width > width:
            wanted = (columns.places >= first) & (columns.places < first + width)
            here = columns.keys[wanted], columns.places[wanted] - first
        graph.column[here[0]] = here[1]
        sets = _grown(graph, levels, np.concatenate(around), min(width, columns.width - first))
        graph.column[here[0]] = -1
        if first == 0:  # the frame itself: each pair once
            for top in range(0, len(block), FRAME):
                square = sets[top : top + FRAME, : FRAME // 64]
                square &= later[: len(square)]
        counts, others = _members(sets, frames * columns.width + first)
        owners = np.flatnonzero(counts)
        if len(owners):
            places = owners + frames[owners] * (columns.width - FRAME)
            yield Pairs(columns.vertices, places, counts[owners], others)


def _hub_pairs(graph: _Graph, is_hub: Bools, around: list[Ints], rings: int) -> Iterator[Pairs]:
    """Find the pairs that have a hub in them, hub by hub: there are few, and each has many."""
    for hub, ring in zip(np.flatnonzero(is_hub), around):
        near = np.concatenate(_levels(graph, np.array([hub]), ring, rings)[0])
        graph.row[near] = -1
        vertices = near.compress(~is_hub[near] | (near >= hub))  # the hub itself is the first of them
        if len(vertices) > 1:
            yield Pairs(vertices, np.array([0]), np.array([len(vertices) - 1]), np.arange(1, len(vertices)))


def _levels(graph: _Graph, block: Ints, near: Ints, rings: int) -> tuple[list[Ints], list[Ints]]:
    """Return the keys of a block, its first ring (of `near`), its second, ..., and leave all marked in `row`.

    Returns
    -------
    levels : the block and its rings
    around : the neighbours of each level but the last, one after the other
    """
    levels, around = [block], [near]
    graph.row[block] = 0
    for ring in range(1, rings + 1):
        front = np.sort(near.compress(np.take(graph.row, near) < 0))
        first = np.ones(len(front), dtype=bool)
        np.not_equal(front[1:], front[:-1], out=first[1:])
        front = front.compress(first)
        graph.row[front] = 0
        levels.append(front)
        if ring < rings:
            near = graph.rows_of(front)
            around.append(near)
    return levels, around


def _columns(count: int, start: int, levels: list[Ints], is_hub: Bools) -> _Columns:
    """Give each frame's vertices, and those of higher number around it, a column of the frame's rows; hubs none."""
    block = levels[0]
    halo = np.sort(np.concatenate(levels[1:]))
    frame = halo // count
    # the pairs with a vertex of lower number belong to that one's frame
    later = np.flatnonzero(halo - frame * count > start + frame * FRAME)
    halo, frame = np.take(halo, later), np.take(frame, later)
    ends = np.searchsorted(halo, np.arange(FRAMES + 1) * count)
    width = FRAME + -(-int(np.diff(ends).max()) // 64) * 64
    places = np.concatenate((np.arange(len(block)) % FRAME, np.arange(FRAME, FRAME + len(halo)) - ends[frame]))
    keys = np.concatenate((block, halo))
    frames = np.concatenate((block // count, frame))
    vertices = np.zeros(FRAMES * width, dtype=np.int64)
    vertices[frames * width + places] = keys - frames * count
    if is_hub.any():
        seen = np.flatnonzero(~is_hub[keys % count])
        keys, places = keys[seen], places[seen]
    return _Columns(keys, places, width, vertices)


def _later_bits(size: int) -> Bits:
    """Return rows of bits: in row i all that come after i."""
    return np.packbits(np.tri(size, k=0, dtype=np.uint8) ^ 1, axis=1, bitorder="little").view(WORD)


def _grown(graph: _Graph, levels: list[Ints], around: Ints, width: int) -> Bits:
    """Return what lies within the rings of each key of the block, as rows of bits over `graph.column`."""
    rings = len(levels) - 1
    inner = np.concatenate(levels[:-1])
    graph.row[inner] = np.arange(len(inner))
    sets = _one_ring_sets(graph, inner, around, width)
    for ring in range(2, rings + 1):
        sets = _united(graph, np.concatenate(levels[: rings + 1 - ring]), sets)
    return np.take(sets, np.take(graph.row, levels[0]), axis=0)


def _one_ring_sets(graph: _Graph, keys: Ints, around: Ints, width: int) -> Bits:
    """Return for each key the set of itself and its neighbours, which stand in `around` one after the other."""
    words = (width + 63) // 64
    firsts = np.arange(0, len(keys) * words, words)
    counts = np.take(graph.counts, keys % len(graph.counts))
    columns = np.take(graph.column, np.concatenate((keys, around)))
    places = np.concatenate((firsts, np.repeat(firsts, counts)))
    wanted = np.flatnonzero(columns >= 0)
    columns, places = np.take(columns, wanted), np.take(places, wanted)
    places += columns >> 6
    columns &= 63
    sets = np.zeros((len(keys), words), dtype=WORD)
    # each bit comes once, so that adding sets it: add.at is several times as quick as bitwise_or.at
    np.add.at(sets.reshape(-1), places, np.left_shift(np.uint64(1), columns.view(np.uint64)))
    return sets


def _united(graph: _Graph, keys: Ints, sets: Bits) -> Bits:
    """Unite the set of each key with its neighbours' sets, and number the rows anew."""
    count = len(graph.counts)
    # those of most neighbours first: the i-th neighbours then belong to the first so many rows
    order = np.sort((-np.take(graph.counts, keys % count) << 40) + keys)
    counts = -(order >> 40)
    keys = order & ((1 << 40) - 1)
    shifts = keys // count * count
    starts = np.take(graph.offsets, keys - shifts)
    united = np.take(sets, np.take(graph.row, keys), axis=0)
    long = int(np.searchsorted(-counts, -LONG_ROW))
    for row in range(long):
        near = graph.neighbours[starts[row] : starts[row] + counts[row]] + shifts[row]
        np.bitwise_or.reduce(np.take(sets, np.take(graph.row, near), axis=0), axis=0, out=united[row])
    most = int(counts[long]) if long < len(counts) else 0
    ends = np.searchsorted(-counts, -np.arange(most))
    for nth, end in enumerate(ends.tolist()):
        near = np.take(graph.neighbours, starts[long:end] + nth)
        near += shifts[long:end]
        rows = united[long:end]
        np.bitwise_or(rows, np.take(sets, np.take(graph.row, near), axis=0), out=rows)
    graph.row[keys] = np.arange(len(keys))
    return united


def _members(sets: Bits, bases: Ints) -> tuple[Ints, Ints]:
    """Return how many bits are set in each row, and their columns plus the base of their row."""
    octets = sets.view(np.uint8).reshape(-1)
    filled = np.flatnonzero(octets != 0)
    octets = np.take(octets, filled)
    rows = filled // (8 * sets.shape[1])
    filled *= 8
    filled += np.take(bases - np.arange(len(sets)) * (64 * sets.shape[1]), rows)
    bits = np.flatnonzero(np.unpackbits(octets, bitorder="little").view(np.bool_))
    columns = np.take(filled, bits >> 3)
    bits &= 7
    columns += bits
    return np.bincount(rows, np.take(BIT_COUNTS, octets), len(sets)).astype(np.int64), columns
