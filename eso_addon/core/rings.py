# SPDX-License-Identifier: GPL-3.0-or-later
"""All pairs of vertices within so many rings of each other, block by block.

Sets of vertices are rows of bits. What lies within k + 1 rings of a vertex is the union of what lies within k
rings of its neighbours, so rings grow by gathering rows: nothing is sorted, and nothing is found twice.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .adjacency import Ints

Bits = NDArray[np.uint64]

# Vertices a block: enough to make a call of numpy worth its while, few enough for the processor's second cache.
BLOCK = 1024
# No way leads through a vertex of more neighbours than this: the rim of a fan of n faces would hold n * n pairs.
HUB = 1024
# Above this many neighbours a row is united on its own.
LONG_ROW = 64
# Words of 64 bits that the sets of one block may take; where they would take more, the columns come in parts.
MOST_WORDS = 1 << 22
WORD = np.dtype("<u8")


class Pairs(NamedTuple):
    """Pairs of vertices: those numbered `vertices[one[i]]` and `vertices[other[i]]`."""

    vertices: Ints
    one: Ints
    other: Ints


class _Graph(NamedTuple):
    """The one-rings (CSR) with their lengths, and a number for each vertex at hand (-1 elsewhere)."""

    offsets: Ints
    neighbours: Ints
    counts: Ints  # how many neighbours ways lead to: none from a hub
    row: Ints
    column: Ints


def near_pairs(offsets: Ints, neighbours: Ints, rings: int) -> Iterator[Pairs]:
    """Find all pairs of vertices within so many rings of each other, each once.

    Parameters
    ----------
    offsets, neighbours : one-rings of n vertices as CSR; quick where neighbours have numbers close to each other
    rings : 1 or more

    Yields
    ------
    Pairs of one block of vertices with themselves and with vertices of higher number; `vertices` has none twice.
    No way of more than one step leads through a vertex of more than `HUB` neighbours.
    """
    count = len(offsets) - 1
    counts = np.diff(offsets)
    hubs = np.flatnonzero(counts > HUB)
    around_hubs = [neighbours[offsets[hub] : offsets[hub + 1]] for hub in hubs]
    if len(hubs):
        neighbours = neighbours.compress(np.repeat(counts <= HUB, counts))
        counts[hubs] = 0
        offsets = np.concatenate(([0], np.cumsum(counts)))
    graph = _Graph(offsets, neighbours, counts, np.full(count, -1), np.full(count, -1))
    later = _later_bits(BLOCK)
    for start in range(0, count, BLOCK):
        block = np.arange(start, min(start + BLOCK, count))
        levels = _levels(graph, block, neighbours[offsets[start] : offsets[block[-1] + 1]], rings)
        inner = np.concatenate(levels[:-1])
        near = np.concatenate(levels)
        # pairs with a lower vertex belong to that one's block
        columns = near.compress(near >= start)
        width = max(BLOCK, MOST_WORDS // len(inner) * 64)
        for first in range(0, len(columns), width):
            part = columns[first : first + width]
            graph.column[part] = np.arange(len(part))
            graph.column[hubs] = -1
            sets = _grown(graph, levels, inner, len(part))
            graph.column[part] = -1
            if first == 0:  # the block itself: each pair once
                sets[:, : later.shape[1]] &= later[: len(block), : sets.shape[1]]
            one, other = _members(sets)
            other += first
            yield Pairs(columns, one, other)
        graph.row[near] = -1
    yield from _hub_pairs(graph, hubs, around_hubs, rings)


def _hub_pairs(graph: _Graph, hubs: Ints, around: list[Ints], rings: int) -> Iterator[Pairs]:
    """Find the pairs that have a hub in them, hub by hub: there are few, and each has many."""
    is_hub = np.zeros(len(graph.row), dtype=bool)
    is_hub[hubs] = True
    for hub, ring in zip(hubs, around):
        near = np.concatenate(_levels(graph, np.array([hub]), ring, rings))
        graph.row[near] = -1
        vertices = near.compress(~is_hub[near] | (near >= hub))  # the hub itself is the first of them
        other = np.arange(1, len(vertices))
        yield Pairs(vertices, np.zeros_like(other), other)


def _later_bits(size: int) -> Bits:
    """Return rows of bits: in row i all that come after i."""
    return np.packbits(np.tri(size, k=0, dtype=np.uint8) ^ 1, axis=1, bitorder="little").view(WORD)


def _levels(graph: _Graph, block: Ints, near: Ints, rings: int) -> list[Ints]:
    """Return the block, its first ring (among `near`), its second, ..., and leave all marked in `graph.row`."""
    levels = [block]
    graph.row[block] = 0
    for ring in range(rings):
        front = np.sort(near.compress(np.take(graph.row, near) < 0))
        front = front.compress(np.diff(front, prepend=-1) > 0)
        graph.row[front] = 0
        levels.append(front)
        if ring < rings - 1:
            near = _rows(graph, front, np.take(graph.counts, front))
    return levels


def _rows(graph: _Graph, vertices: Ints, counts: Ints) -> Ints:
    """Return the neighbours of all these vertices one after the other."""
    shifts = np.take(graph.offsets, vertices) - np.cumsum(counts) + counts
    places = np.repeat(shifts, counts)
    places += np.arange(len(places))
    return np.take(graph.neighbours, places)


def _grown(graph: _Graph, levels: list[Ints], inner: Ints, width: int) -> Bits:
    """Return what lies within the rings of each vertex of the block, as rows of bits over `graph.column`."""
    rings = len(levels) - 1
    graph.row[inner] = np.arange(len(inner))
    sets = _one_ring_sets(graph, inner, width)
    for ring in range(2, rings + 1):
        sets = _united(graph, np.concatenate(levels[: rings + 1 - ring]), sets)
    return np.take(sets, np.take(graph.row, levels[0]), axis=0)


def _one_ring_sets(graph: _Graph, vertices: Ints, width: int) -> Bits:
    """Return for each vertex the set of itself and its neighbours."""
    counts = np.take(graph.counts, vertices)
    words = (width + 63) // 64
    firsts = np.arange(0, len(vertices) * words, words)
    columns = np.take(graph.column, np.concatenate((vertices, _rows(graph, vertices, counts))))
    places = np.concatenate((firsts, np.repeat(firsts, counts)))
    wanted = np.flatnonzero(columns >= 0)
    columns, places = np.take(columns, wanted), np.take(places, wanted)
    places += columns >> 6
    columns &= 63
    sets = np.zeros((len(vertices), words), dtype=WORD)
    # each bit comes once, so that adding sets it: add.at is several times as quick as bitwise_or.at
    np.add.at(sets.reshape(-1), places, np.left_shift(np.uint64(1), columns.view(np.uint64)))
    return sets


def _united(graph: _Graph, vertices: Ints, sets: Bits) -> Bits:
    """Unite the set of each vertex with its neighbours' sets, and number the rows anew."""
    # those of most neighbours first: the i-th neighbours then belong to the first so many rows
    order = np.sort((-np.take(graph.counts, vertices) << 40) + vertices)
    counts = -(order >> 40)
    vertices = order & ((1 << 40) - 1)
    starts = np.take(graph.offsets, vertices)
    united = np.take(sets, np.take(graph.row, vertices), axis=0)
    long = int(np.searchsorted(-counts, -LONG_ROW))
    for row in range(long):
        near = graph.neighbours[starts[row] : starts[row] + counts[row]]
        np.bitwise_or.reduce(np.take(sets, np.take(graph.row, near), axis=0), axis=0, out=united[row])
    most = int(counts[long]) if long < len(counts) else 0
    ends = np.searchsorted(-counts, -np.arange(most))
    for nth, end in enumerate(ends.tolist()):
        near = np.take(graph.neighbours, starts[long:end] + nth)
        rows = united[long:end]
        np.bitwise_or(rows, np.take(sets, np.take(graph.row, near), axis=0), out=rows)
    graph.row[vertices] = np.arange(len(vertices))
    return united


def _members(sets: Bits) -> tuple[Ints, Ints]:
    """Return the row and the column of each bit that is set."""
    octets = sets.view(np.uint8).reshape(-1)
    filled = np.flatnonzero(octets != 0)
    bits = np.flatnonzero(np.unpackbits(np.take(octets, filled), bitorder="little").view(np.bool_))
    filled <<= 3
    places = np.take(filled, bits >> 3)
    bits &= 7
    places += bits
    width = 64 * sets.shape[1]
    rows = places // width
    places -= rows * width
    return rows, places
