# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh made ready for the engine: mended, welded, wound one way, in Morton order, about the origin and of unit size."""

from dataclasses import dataclass

import numpy as np

from .adjacency import vertex_components
from .manifold import open_vertices, orient, winding_conflicts
from .mesh import Bools, Floats, Ints, MeshError, morton_order, weld


@dataclass(frozen=True)
class Prepared:
    """The engine's mesh, and how it belongs to the input.

    Attributes
    ----------
    points : ndarray, (3, n) float64
    faces : ndarray, (3, m) int64
    opened : ndarray, (n,) bool
        Vertices at a boundary or at an edge that is not manifold.
    center, size
        An engine's position times `size`, plus `center`, is the input's.
    source : ndarray, (n,) int64
        An input vertex at each vertex.
    vertex : ndarray, (input vertices,) int64
        The engine's vertex at each input vertex, -1 where no face uses it.
    sheet : ndarray, (input vertices,) int64, or None
        The connected part of each input vertex before the weld; None where the weld joined nothing.
    face : ndarray, (m,) int64
        The input face of each face.
    turned : ndarray, (m,) bool, or None
        Faces wound the other way than in the input; None where there are none.
    messages : tuple of str
        What was mended.
    """

    points: Floats
    faces: Ints
    opened: Bools
    center: Floats
    size: float
    source: Ints
    vertex: Ints
    sheet: Ints | None
    face: Ints
    turned: Bools | None
    messages: tuple[str, ...]


def prepare(vertices: Floats, faces: Ints, *, join: bool = True, prune: float = 0.0) -> Prepared:
    """Make a mesh ready for the engine.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    join : bool
        Treat vertices at equal positions as one.
    prune : float
        Drop connected parts whose bounding box has a smaller diagonal.

    Returns
    -------
    Prepared

    Raises
    ------
    MeshError
        No face is left, or coordinates too large to work with.
    """
    messages = []
    if len(faces) == 0:
        raise MeshError("the mesh has no faces: there is nothing to simplify")
    representative = weld(vertices) if join else np.arange(len(vertices))
    joined = representative.take(faces)
    kept = np.flatnonzero(_distinct(joined))
    if len(kept) < len(faces):
        messages.append(f"{len(faces) - len(kept)} faces without area or repeated were dropped")
        joined = joined.take(kept, axis=0)
    if prune > 0 and len(kept):
        large = _large_parts(vertices, joined, prune)
        if not large.all():
            messages.append(f"{len(large) - int(large.sum())} faces of parts smaller than {prune:g} were dropped")
            kept, joined = kept[large], joined[large]
    if len(kept) == 0:
        raise MeshError("no face with three distinct corners is left: there is nothing to simplify")
    split = _sheets(faces, len(vertices), representative, kept)
    used = np.zeros(len(vertices), bool)
    used[joined] = True
    source = np.flatnonzero(used)
    source = source.take(morton_order(vertices.take(source, axis=0)))
    number = np.full(len(vertices), -1)
    number[source] = np.arange(len(source))
    corners = number.take(joined.T)
    lowest = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    order = np.sort((lowest << 32) | np.arange(len(kept))) & 0xFFFFFFFF
    corners, kept = corners.take(order, axis=1), kept.take(order)
    opened = open_vertices(corners, len(source))
    turned = None
    if winding_conflicts(corners, opened):
        turned = orient(corners, len(source))
        corners[1:, turned] = corners[:0:-1, turned]
        opened = open_vertices(corners, len(source))
    placed = vertices.take(source, axis=0)
    low, high = placed.min(axis=0), placed.max(axis=0)
    center = low + (high - low) / 2
    extent = float((high - low).max())
    if not np.isfinite(extent):
        raise MeshError("coordinates are too large: scale the mesh down first")
    size = extent * float(np.linalg.norm((high - low) / extent))
    points = np.ascontiguousarray(((placed - center) / size).T)
    vertex = number.take(representative)
    return Prepared(points, corners, opened, center, size, source, vertex, split, kept, turned, tuple(messages))


def _distinct(faces: Ints) -> Bools:
    """Tell the faces with three different corners that do not repeat an earlier face the same way round."""
    a, b, c = faces.T
    proper = (a != b) & (b != c) & (c != a)
    low = np.minimum(np.minimum(a, b), c)
    following = np.where(low == a, b, np.where(low == b, c, a))
    preceding = np.where(low == a, c, np.where(low == b, a, b))
    count = int(faces.max(initial=0)) + 1
    # faces whose first side is no other's cannot be repeated: few are left to compare whole
    keys = np.sort(low * count + following)
    if (keys[1:] == keys[:-1]).any():
        _, first = np.unique(np.stack((low, following, preceding), axis=1), axis=0, return_index=True)
        repeated = np.ones(len(faces), bool)
        repeated[first] = False
        proper &= ~repeated
    return proper


def _large_parts(vertices: Floats, faces: Ints, least: float) -> Bools:
    """Tell the faces of connected parts whose bounding box has a diagonal of at least so much."""
    part = vertex_components(faces, len(vertices)).take(faces[:, 0])
    count = int(part.max()) + 1
    square = np.zeros(count)
    for axis in range(3):
        values = vertices[:, axis].take(faces)
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, part, values.min(axis=1))
        np.maximum.at(high, part, values.max(axis=1))
        square += (high - low) ** 2
    return (square >= least * least).take(part)


def _sheets(faces: Ints, count: int, representative: Ints, kept: Ints) -> Ints | None:
    """Return the connected part of each vertex before the weld, where the weld joined vertices of different parts."""
    if np.array_equal(representative, np.arange(count)):
        return None
    return vertex_components(faces.take(kept, axis=0), count)
