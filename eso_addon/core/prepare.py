# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh made ready for the engine: mended, welded, wound one way, in Morton order, of unit size about the origin."""

from dataclasses import dataclass

import numpy as np

from .adjacency import part_diagonals, vertex_components
from .manifold import boundary_sides, open_vertices, orient, winding_conflicts
from .mesh import Bools, Floats, Ints, MeshError, bounds, hashes, morton_order, morton_weld


@dataclass(frozen=True)
class Prepared:
    """The engine's mesh, and how it belongs to the input.

    Attributes
    ----------
    points : ndarray, (3, n) float64
    faces : ndarray, (3, m) int64
    opened : ndarray, (n,) bool
        Vertices at a boundary or at an edge that is not manifold.
    boundary : ndarray, (b,) int64
        Sides without another face, as slots j * m + face.
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
    boundary: Ints
    center: Floats
    size: float
    source: Ints
    vertex: Ints
    sheet: Ints | None
    face: Ints
    turned: Bools | None
    messages: tuple[str, ...]

    @property
    def boundary_edges(self) -> Ints:
        """The vertices of the sides without another face, (2, b) int64."""
        faces = self.faces
        return np.stack([rows.ravel().take(self.boundary) for rows in (faces, np.roll(faces, -1, axis=0))])


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
    vertex, source = _numbers(vertices, faces, join)
    corners = vertex.take(faces.T)
    kept = _distinct(corners)
    if len(kept) < len(faces):
        messages.append(f"{len(faces) - len(kept)} faces without area or repeated were dropped")
        corners = corners.take(kept, axis=1)
    if prune > 0 and len(kept):
        large = np.flatnonzero(_large_parts(vertices.take(source, axis=0), corners.T, prune))
        if len(large) < len(kept):
            messages.append(f"{len(kept) - len(large)} faces of parts smaller than {prune:g} were dropped")
            kept, corners = kept.take(large), corners.take(large, axis=1)
    if len(kept) == 0:
        raise MeshError("no face with three distinct corners is left: there is nothing to simplify")
    lowest = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    order = np.sort((lowest << 32) | np.arange(len(kept))) & 0xFFFFFFFF
    corners, kept = corners.take(order, axis=1), kept.take(order)
    opened = open_vertices(corners, len(source))
    turned = None
    if winding_conflicts(corners, opened):
        turned = orient(corners, len(source))
        corners[1:, turned] = corners[:0:-1, turned]
        opened = open_vertices(corners, len(source))
    boundary = boundary_sides(corners, opened)
    placed = vertices.take(source, axis=0)
    low, high = bounds(placed)
    with np.errstate(over="ignore"):
        extent = float((high - low).max())
        center = low + (high - low) / 2
    if not np.isfinite(extent):
        raise MeshError("coordinates are too large: scale the mesh down first")
    size = extent * float(np.linalg.norm((high - low) / extent))
    points = np.ascontiguousarray(((placed - center) / size).T)
    joined = len(source) < np.count_nonzero(vertex >= 0)
    split = vertex_components(faces.take(kept, axis=0), len(vertices)) if joined else None
    return Prepared(points, corners, opened, boundary, center, size, source, vertex, split, kept, turned,
                    tuple(messages))


def _numbers(vertices: Floats, faces: Ints, join: bool) -> tuple[Ints, Ints]:
    """Return the number of each vertex's position along a Morton curve, -1 if unused, and a vertex at each position."""
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    some = None if used.all() else np.flatnonzero(used)
    points = vertices if some is None else vertices.take(some, axis=0)
    if join:
        order, new = morton_weld(points)
    else:
        order = morton_order(points)
        new = np.ones(len(order), bool)
    order = order if some is None else some.take(order)
    vertex = np.full(len(vertices), -1)
    vertex[order] = np.cumsum(new) - 1
    return vertex, order if new.all() else order.compress(new)


def _distinct(faces: Ints) -> Ints:
    """Return the (3, m) faces with three different corners that do not repeat an earlier one the same way round."""
    a, b, c = faces
    proper = (a != b) & (b != c) & (c != a)
    # of faces with the same corners the sums are the same: few others are left to compare whole
    mixed = hashes(int(faces.max(initial=0)) + 1)
    sums = mixed.take(a) + mixed.take(b) + mixed.take(c)
    ranked = np.sort(sums)
    if (ranked[1:] == ranked[:-1]).any():
        low = np.minimum(np.minimum(a, b), c)
        following = np.where(low == a, b, np.where(low == b, c, a))
        preceding = np.where(low == a, c, np.where(low == b, a, b))
        _, first = np.unique(np.stack((low, following, preceding), axis=1), axis=0, return_index=True)
        repeated = np.ones(len(a), bool)
        repeated[first] = False
        proper &= ~repeated
    return np.flatnonzero(proper)


def _large_parts(vertices: Floats, faces: Ints, least: float) -> Bools:
    """Tell the faces of connected parts whose bounding box has a diagonal of at least so much."""
    part = vertex_components(faces, len(vertices)).take(faces[:, 0])
    return (part_diagonals(vertices, faces, part) >= least).take(part)
