# SPDX-License-Identifier: GPL-3.0-or-later
"""Data on the edges of a level: each edge has what the original edge had that it descends from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .adjacency import unique_edges
from .attributes import AttributeSet
from .lines import Lines
from .mesh import Floats, Ints


def carried_edges(attributes: AttributeSet, points: Floats, vertex: Ints, lines: Lines, survivor: Ints,
                  level_vertex: Ints, corners: Ints, placed: Floats) -> tuple[Ints, dict[str, NDArray]]:
    """Return the edges of a level, (e, 2) int64, and the edge attributes on them.

    Many original edges may lie between two parts of a mesh that have become vertices: one on a line is taken first,
    then the one whose middle is nearest.

    Parameters
    ----------
    attributes : AttributeSet
    points : ndarray, (3, n) float64
        The engine's vertices where they stood.
    vertex : ndarray, (input's vertices,) int64
        The engine's vertex at each of the input's, -1 where there is none.
    lines : Lines
    survivor : ndarray, (n,) int64
        The level's vertex that each has become.
    level_vertex : ndarray, (v,) int64
        The same for the vertices of `corners`.
    corners : ndarray, (f, 3) int64
    placed : ndarray, (k, 3) float64
    """
    layers = attributes.on("edge")
    if not layers:
        return np.zeros((0, 2), np.int64), {}
    edges, _ = unique_edges(corners, len(level_vertex))
    count = len(placed) + 1
    wanted = _keys(level_vertex.take(edges).T, count)
    known = np.flatnonzero((vertex.take(attributes.edges) >= 0).all(axis=1))
    ends = vertex.take(attributes.edges.take(known, axis=0)).T
    names, place = np.unique(wanted, return_inverse=True)
    keys = _keys(survivor.take(ends), count)
    found = np.searchsorted(names, keys).clip(max=max(len(names) - 1, 0))
    meets = np.flatnonzero(names.take(found) == keys) if len(names) else np.zeros(0, np.int64)
    ends, found, known = ends.take(meets, axis=1), found.take(meets), known.take(meets)
    middle = np.zeros((3, len(names)))
    middle[:, place] = placed.take(level_vertex.take(edges), axis=0).mean(axis=1).T
    offset = points.take(ends, axis=1).mean(axis=1) - middle.take(found, axis=1)
    score = (offset * offset).sum(axis=0)
    score[~np.isin(_keys(ends, points.shape[1]), _keys(lines.edges, points.shape[1]))] += np.ptp(points) ** 2 * 100 + 1
    order = np.lexsort((score, found))
    first = order[np.flatnonzero(np.diff(found.take(order), prepend=-1))]
    source = np.full(len(names), -1)
    source[found.take(first)] = known.take(first)
    source = source.take(place)
    values = {}
    for layer in layers:
        rows = np.zeros((len(edges), layer.rows.shape[1]), layer.rows.dtype)
        rows[source >= 0] = layer.rows.take(source[source >= 0], axis=0)
        values[layer.name] = layer.shaped(rows)
    return edges, values


def _keys(edges: Ints, count: int) -> Ints:
    return np.minimum(edges[0], edges[1]) * count + np.maximum(edges[0], edges[1])
