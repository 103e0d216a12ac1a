# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be streamed: places where vertices stand, and the wedges (vertex and corner attributes) at each place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.mesh import Ints, MeshError, morton_order, weld
from .geometry import place_of

DOMAINS = ("vertex", "corner", "face", "side", "edge")
Attributes = dict[str, dict[str, np.ndarray]]
_KINDS = "?bBhHiIlLqQefd"


@dataclass
class Source:
    """A mesh of places and wedges.

    Attributes
    ----------
    places : ndarray, (p, 3) float32
        Different positions, by their bits, along a curve through space.
    faces : ndarray, (m, 3) int64
        Places.
    wedge : ndarray, (m, 3) int64
        Which wedge of its place each corner has.
    wedge_starts : ndarray, (p + 1,) int64
        The wedges of each place, one after the other.
    wedge_vertex : ndarray, (w,) int64
        The vertex of each wedge, ascending within a place.
    wedge_corner : ndarray, (w,) int64
        A corner (face * 3 + row) with that wedge, -1 where the vertex has none.
    vertices, vertex_place
        Number of vertices, and the place of each.
    edges : ndarray, (l, 2) int64
        Loose edges, as vertices.
    attributes : dict of dict of ndarray
        By domain and name.
    """

    places: np.ndarray
    faces: Ints
    wedge: Ints
    wedge_starts: Ints
    wedge_vertex: Ints
    wedge_corner: Ints
    vertex_place: Ints
    corner_vertex: Ints
    edges: Ints
    attributes: Attributes = field(default_factory=dict)


def make_source(vertices: ArrayLike, faces: ArrayLike, attributes: Mapping[str, Mapping[str, ArrayLike]] | None,
                edges: ArrayLike | None) -> Source:
    """Check a mesh and find its places and wedges.

    Raises
    ------
    MeshError
        Wrong shapes or dtypes, or an index out of range.
    """
    positions = _rows(vertices, "vertices", 3, "fiu").astype(np.float32)
    corners = _rows(faces, "faces", 3, "iu").astype(np.int64)
    loose = _rows(() if edges is None else edges, "edges", 2, "iu").astype(np.int64)
    for name, indices in (("face", corners), ("edge", loose)):
        if indices.size and (indices.min() < 0 or indices.max() >= len(positions)):
            raise MeshError(f"a {name} names a vertex that is not there ({len(positions)} vertices): repair the mesh")
    counts = {"vertex": (len(positions),), "corner": corners.shape, "face": (len(corners),), "side": corners.shape,
              "edge": (len(loose),)}
    checked = _attributes(attributes or {}, counts)
    representative = weld(place_of(positions).astype(np.float64))
    own = np.flatnonzero(representative == np.arange(len(positions)))
    # neighbours in space are neighbours in memory from here on
    own = own.take(morton_order(np.where(np.isfinite(positions[own]), positions[own], 0).astype(np.float64)))
    number = np.zeros(len(positions), np.int64)
    number[own] = np.arange(len(own))
    place = number.take(representative)
    wedge, starts, wedge_vertex, wedge_corner = _wedges(corners, place, own, checked["corner"])
    return Source(positions[own], place.take(corners), wedge, starts, wedge_vertex, wedge_corner, place, corners, loose,
                  checked)


def _rows(values: ArrayLike, name: str, width: int, kinds: str) -> np.ndarray:
    array = np.asarray(values)
    if array.size == 0:
        return np.zeros((0, width), np.float32 if "f" in kinds else np.int64)
    if array.ndim != 2 or array.shape[1] != width or array.dtype.kind not in kinds:
        raise MeshError(f"{name} must be an (n, {width}) array of numbers, not {array.shape} {array.dtype}")
    return array


def _attributes(given: Mapping[str, Mapping[str, ArrayLike]], counts: dict[str, tuple[int, ...]]) -> Attributes:
    checked: Attributes = {domain: {} for domain in DOMAINS}
    for domain, named in given.items():
        if domain not in DOMAINS:
            raise MeshError(f"unknown attribute domain {domain!r}: choose one of {', '.join(DOMAINS)}")
        for name, values in named.items():
            array: np.ndarray[Any, Any] = np.ascontiguousarray(values)
            wanted = counts[domain]
            if array.dtype.char not in _KINDS or array.shape[: len(wanted)] != wanted or array.ndim > len(wanted) + 1:
                raise MeshError(f"{domain} attribute {name!r} must be numbers of shape {wanted} or one more axis, "
                                f"not {array.shape} {array.dtype}")
            checked[domain][name] = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return checked


def rows_as_bytes(named: Mapping[Any, np.ndarray], rows: int) -> np.ndarray:
    """Return all attributes of a domain as (rows, bytes) uint8, side by side."""
    parts = [np.ascontiguousarray(array).ravel().view(np.uint8).reshape(rows, array.nbytes // max(rows, 1))
             for array in named.values()]
    return np.concatenate([np.zeros((rows, 0), np.uint8), *parts], axis=1)


def _wedges(corners: Ints, place: Ints, own: Ints, named: dict[str, np.ndarray]) -> tuple[Ints, Ints, Ints, Ints]:
    """Give numbers to the different (vertex, corner attributes) at each place; `own` is a vertex at each."""
    places = len(own)
    flat = corners.ravel()
    kind = distinct(rows_as_bytes(named, len(flat))) if named else np.zeros(len(flat), np.int64)
    kinds = int(kind.max(initial=0)) + 1
    unused = np.ones(len(place), bool)
    unused[flat] = False
    idle = np.flatnonzero(unused)
    keys = np.concatenate((flat, idle)) * kinds + np.concatenate((kind, np.zeros(len(idle), np.int64)))
    if kinds == 1 and len(place) == places:  # one wedge a vertex, one vertex a place
        first = np.full(len(place), -1)
        first[flat[::-1]] = np.arange(len(flat))[::-1]
        return np.zeros_like(corners), np.arange(places + 1), own, first.take(own)
    keys, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    vertex = keys // kinds
    order = np.argsort(place.take(vertex) * len(place) + vertex, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    starts = np.concatenate(([0], np.cumsum(np.bincount(place.take(vertex), minlength=places))))
    wedge = rank.take(inverse.ravel()[: len(flat)]) - starts.take(place.take(flat))
    first = first.take(order)
    return wedge.reshape(corners.shape), starts, vertex.take(order), np.where(first < len(flat), first, -1)


def distinct(rows: np.ndarray) -> Ints:
    """Give numbers to the different rows of bytes: (n,) int64."""
    if rows.shape[1] == 0:
        return np.zeros(len(rows), np.int64)
    padded = np.zeros((len(rows), -(-rows.shape[1] // 8) * 8), np.uint8)
    padded[:, : rows.shape[1]] = rows
    words = padded.view(np.uint64)
    mixed = np.zeros(len(rows), np.uint64)
    for column in words.T:
        mixed = (mixed ^ column) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    if np.array_equal(words, words[first[inverse]]):
        return inverse
    return np.unique(words, axis=0, return_inverse=True)[1].ravel()
