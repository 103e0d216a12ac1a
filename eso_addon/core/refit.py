# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves the vertices and flips the edges of a simplified mesh so that its surface fits samples of the original one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .adjacency import boundary_vertices, face_neighbors, stars
from .closest import ClosestPoints, closest_in_triangles, squared_distances, triangle_frames
from .curves import Curves
from .flips import flip_edges
from .guard import HALVINGS, halve, hold_flips
from .least_squares import Meeting, Samples, best_step
from .mesh import bounds
from .normals import face_area_vectors, face_areas, face_normals
from .reinsertion import reinsert, with_parts

Bools = NDArray[np.bool_]
Floats = NDArray[Any]  # float64, or float32 where only a choice hangs on it
Ints = NDArray[np.int64]

_ROUNDS = 5
_PER_FACE = 10
_LEAST = 5000  # and at least so many in all: they are soon done, and miss nothing of a small mesh
_SINGLE = 1e-5  # rounding of squared distances in single precision
_ROUNDING = 5e-7  # of distances in single precision, in a mesh of unit size
_NOTHING = 1e-7  # of a step that single precision may have made: straight borders along an axis stay straight
_FAR = 9.0  # times the median squared distance
_BLOCK = 8192


class Refitted(NamedTuple):
    """A mesh fitted to its original.

    Attributes
    ----------
    vertices : (k + c, 3) float64
        The new positions, those of vertices that came back last; fixed vertices have theirs bit for bit.
    faces : (m + 2 c, 3) int64
    corner : (m + 2 c, 3) int64
        The corner of the given faces that each one was, as 3 * face + number; of a vertex that came back one of a
        face that it lies on.
    back : (c,) int64
        The original vertices that came back.
    source : (s,) int64
        Faces of the original whose centres are samples.
    met : Meeting, optional
        Where these lie nearest to the new faces; None if nothing was fitted.
    """

    vertices: Floats
    faces: Ints
    corner: Ints
    back: Ints
    source: Ints
    met: Meeting | None

    @classmethod
    def unfitted(cls, vertices: Floats, faces: Ints) -> Refitted:
        """Return a mesh as it is."""
        none = np.zeros(0, np.int64)
        return cls(vertices, faces, np.arange(faces.size).reshape(faces.shape), none, none, None)


def refit(vertices: Floats, faces: Ints, original_vertices: Floats, original_faces: Ints, *,
          vertex_map: Ints | None = None, fixed: Bools | None = None, bound: Bools | None = None,
          group: Ints | None = None, rounds: int = _ROUNDS, flips: bool = True, spare: int = 0,
          apart: Bools | None = None, lines: Ints | None = None) -> Refitted:
    """Fit a simplified mesh to its original by moving its vertices and flipping its edges.

    First the original vertices that are farthest from it come back, if any may. Each round finds the closest point on
    the simplified surface for samples of the original, then solves a damped least squares for the positions with those
    correspondences held (Hoppe et al. 1993, Mesh optimization, section 4.1). Between two rounds, edges flip where that
    brings the surface nearer. No face turns over or into a sliver, and the largest distance of a sample does not rise.

    Parameters
    ----------
    vertices, faces : (k, 3) float64 and (m, 3) int64
        The simplified mesh.
    original_vertices, original_faces : (n, 3) float64 and (p, 3) int64
        What it came from.
    vertex_map : (n,) int64, optional
        The simplified vertex each original vertex was collapsed into, -1 if none: spares a search over the mesh.
    fixed : (k,) or (k, 3) bool, optional
        Vertices, or coordinates of them, that must stay; boundary vertices do too, unless they are on lines.
    bound, group : optional
        Edges that must stay: see `flips.flip_edges`.
    rounds : int
    flips : bool
        Without them the triangles stay what they are.
    spare : int
        Original vertices that may come back; each makes two more triangles.
    apart : (n,) bool, optional
        Original vertices that must not.
    lines : (2, l) int64, optional
        Edges of the original that the simplified mesh's must follow; needs `vertex_map`.
    """
    held = boundary_vertices(faces, len(vertices))
    if lines is not None and vertex_map is not None:
        ends = vertex_map.take(lines)
        held[ends[ends >= 0]] = False
    held = np.repeat(held[:, None], 3, axis=1)
    if fixed is not None:
        held |= fixed if fixed.ndim == 2 else fixed[:, None]
    flat = not face_area_vectors(original_vertices, original_faces).any()
    if len(faces) == 0 or rounds < 1 or flat or (held.all() and not flips):
        return Refitted.unfitted(vertices.copy(), faces)
    fit, center, size = _begun(vertices, faces, original_vertices, original_faces, vertex_map, held, lines)
    fit.bound, fit.group = bound, group
    back = fit.reinsert(spare, apart)
    vertices = np.concatenate((vertices, original_vertices.take(back, axis=0)))
    start = fit.vertices
    for done in range(rounds):
        fit.move()
        if flips and done < rounds - 1:
            fit.flip()
    moved = fit.vertices
    placed = np.where(moved == start, vertices, moved * size + center)
    return Refitted(placed, fit.faces, fit.corner, back, fit.samples.face, fit.met())


def _begun(vertices: Floats, faces: Ints, original_vertices: Floats, original_faces: Ints, vertex_map: Ints | None,
           held: Bools, lines: Ints | None) -> tuple[_Fit, Floats, float]:
    """Return what is fitted, in a frame of its own: about this centre, and of this size."""
    # unit size and the origin in the middle keep the precision of small parts of large scenes
    low, high = bounds(vertices)
    center, size = (low + high) / 2, float((high - low).max()) or 1.0
    wanted = max(_PER_FACE * len(faces), _LEAST)
    samples, near = _samples((original_vertices - center) / size, original_faces, wanted)
    start = (vertices - center) / size
    face = _first_faces(start, faces, samples.points, None if vertex_map is None else vertex_map.take(near))
    fit = _Fit(start, faces, samples, face, held)
    if lines is not None and lines.size and vertex_map is not None:
        fit.curves = Curves((original_vertices - center) / size, lines, vertex_map)
    return fit, center, size


def _samples(vertices: Floats, faces: Ints, wanted: int) -> tuple[Samples, Ints]:
    """Return vertices and face centres, about `wanted` where there are more, and a vertex near each.

    Vertices hold the features, centres the area between: together they integrate squares over a triangle exactly.
    """
    areas = face_areas(vertices, faces)
    star = np.bincount(faces.ravel(), np.repeat(areas, 3), minlength=len(vertices))
    used = np.flatnonzero(star > 0)
    share = min(1.0, wanted / (len(used) + len(faces)))
    pick, middle = _evenly(len(used), share), _evenly(len(faces), share)
    pick = used[pick]
    corners = faces[middle]
    centers = (vertices.take(corners[:, 0], axis=0) + vertices.take(corners[:, 1], axis=0)) / 3
    centers += vertices.take(corners[:, 2], axis=0) / 3
    weights = np.concatenate([star[pick] / 12, areas[middle] * 0.75])
    normals = np.concatenate([np.zeros((len(pick), 3)), face_normals(vertices, corners)])
    exact = np.ascontiguousarray(np.concatenate([vertices[pick], centers]).T)
    # single precision decides which face is near: it takes half the time, and positions are solved in double
    samples = Samples(exact, exact.astype(np.float32), weights / weights.mean(), np.ascontiguousarray(normals.T), pick,
                      middle)
    return samples, np.concatenate([pick, corners[:, 0]])


def _evenly(count: int, share: float) -> Ints:
    """Return a share of the indices up to `count`, at even steps."""
    kept = max(1, int(count * share))
    return np.arange(kept) * count // kept


class _Fit:
    """A simplified mesh on its way to its samples, each with its nearest face."""

    def __init__(self, vertices: Floats, faces: Ints, samples: Samples, face: Ints, held: Bools) -> None:
        self.vertices, self.faces = vertices, faces
        self.corner = np.arange(faces.size).reshape(faces.shape)
        self.samples, self.face, self.held = samples, face, held
        self.curves: Curves | None = None
        self.bound: Bools | None = None
        self.group: Ints | None = None
        self.fresh: Bools | None = None  # faces that the last flips made; edges of others were no better flipped
        self.start = vertices  # since the last flips: what faces turn against
        self.neighbors = face_neighbors(faces, len(vertices))
        self.squared, self.closest = np.empty(len(face)), np.empty_like(samples.points)
        self._look()
        # a guess goes wrong over long triangles and sharp edges: samples that seem far away are looked up exactly
        far = np.flatnonzero(self.squared > _FAR * np.median(self.squared))
        found = ClosestPoints(vertices, faces).query(samples.points.take(far, axis=1).T, hint=self.face[far])[1]
        self.face[far] = found
        self._look(far)
        self.worst = float(self.squared.max())

    def _look(self, which: Ints | None = None) -> None:
        """Follow the samples' nearest faces, or those of some samples, to where the vertices now are."""
        some = slice(None) if which is None else which
        found = _correspond(self.vertices, self.faces, self.samples.points[:, some], self.face[some], self.neighbors)
        self.face[some], self.squared[some], self.closest[:, some] = found

    def _beside(self, changed: Bools) -> Ints:
        """Return the samples whose nearest face, or one across its sides, has changed."""
        near = changed | changed.take(self.neighbors).any(axis=0)
        return np.flatnonzero(near.take(self.face))

    def move(self) -> None:
        """Move the vertices to where the samples pull them, but none that makes the worst sample worse."""
        now, faces = self.vertices, self.faces
        step = self._step()
        step[self.held] = 0
        step[np.abs(step) < _NOTHING] = 0
        share, judged = np.ones(len(now)), np.arange(len(faces))
        for _ in range(2 * HALVINGS):
            hold_flips(now, step, share, faces, self.start, judged)
            before, self.vertices = self.vertices, now + share[:, None] * step
            moved = (self.vertices != before).any(axis=1)
            self._look(self._beside(moved.take(faces).any(axis=1)))
            bad = self.squared > self.worst * (1 + _SINGLE)
            if not bad.any():
                break
            judged = halve(share, faces, self.face[bad])
        else:
            self.vertices = now
            self._look()
        self.worst = min(self.worst, float(self.squared.max()))

    def _step(self) -> Floats:
        """Return where the samples pull the vertices, and those of lines too: their edges are faces of no area."""
        faces, samples, face, curves = self.faces, self.samples, self.face, self.curves
        places = _barycentric(self.vertices, faces, face, self.closest)
        if curves is not None and curves.exact.size:
            edge, shares = curves.look(self.vertices)
            heavy = curves.weights(float(face_areas(self.vertices, faces).sum()), len(faces)) * samples.weights.sum()
            samples = samples._replace(
                exact=np.concatenate((samples.exact, curves.exact), axis=1),
                weights=np.concatenate((samples.weights, heavy)),
                normals=np.concatenate((samples.normals, np.zeros_like(curves.exact)), axis=1))
            face = np.concatenate((face, edge + len(faces)))
            faces = np.concatenate((faces, curves.edges[[0, 1, 1]].T))
            places = np.concatenate((places, np.concatenate((shares, np.zeros((1, len(edge)))))), axis=1)
        return best_step(self.vertices, faces, samples, face, places)

    def met(self) -> Meeting:
        """Return where the samples that are centres of faces now lie."""
        some = slice(len(self.samples.vertex), None)
        places = _barycentric(self.vertices, self.faces, self.face[some], self.closest[:, some])
        return Meeting(self.face[some], places, self.samples.weights[some])

    def reinsert(self, wanted: int, apart: Bools | None) -> Ints:
        """Make vertices of the farthest samples that are the original's vertices; return which of these."""
        vertex = self.samples.vertex
        if not wanted:
            return vertex[:0]
        some = slice(len(vertex))
        squared = self.squared[some] if apart is None else np.where(apart.take(vertex), 0, self.squared[some])
        weights = _barycentric(self.vertices, self.faces, self.face[some], self.closest[:, some])
        made = reinsert(self.vertices, self.faces, self.neighbors, self.samples.exact[:, some], squared,
                        self.face[some], weights, wanted, self._free_sides())
        new = np.zeros(len(made.chosen), bool)
        self.vertices = np.concatenate((self.vertices, self.samples.exact[:, made.chosen].T))
        self.held = np.concatenate((self.held, np.zeros((len(new), 3), bool)))
        if self.bound is not None:
            self.bound = np.concatenate((self.bound, new))
        if self.group is not None:
            self.group = with_parts(self.group, made.corner)
        self._changed(made.faces, made.corner)
        self.worst = float(self.squared.max())
        return vertex.take(made.chosen)

    def _free_sides(self) -> Bools:
        """Tell the sides, (3, m), that no line runs along."""
        free = np.ones(self.neighbors.shape, bool)
        ends = self.faces.T
        if self.bound is not None:
            bound = self.bound.take(ends)
            free &= ~(bound & np.roll(bound, -1, axis=0))
        if self.group is not None:
            free &= self.group.take(self.neighbors) == self.group
        return free

    def _changed(self, faces: Ints, corner: Ints) -> Bools:
        """Take other faces, whose corners these were, and tell those that are not as they were.

        The samples beside these are looked up again.
        """
        kept = np.zeros(len(faces), bool)
        kept[: len(self.faces)] = (faces[: len(self.faces)] == self.faces).all(axis=1)
        if kept.all():
            return ~kept
        self.faces, self.corner = faces, self.corner.ravel().take(corner)
        self.start = self.vertices
        self.neighbors = face_neighbors(faces, len(self.vertices))
        self._look(self._beside(~kept))
        return ~kept

    def flip(self) -> None:
        """Flip edges where that brings the samples nearer."""
        points, weights, normals = self.samples.points, self.samples.weights, self.samples.normals
        corner, self.face = flip_edges(self.vertices, self.faces, points, normals, weights, self.face, self.squared,
                                       bound=self.bound, group=self.group, among=self.fresh)
        self.fresh = self._changed(self.faces.ravel().take(corner), corner)


def _first_faces(vertices: Floats, faces: Ints, points: Floats, survivor: Ints | None) -> Ints:
    """Return a near face for each sample: the best around its survivor, or the closest of all where there is none."""
    if survivor is None:
        return ClosestPoints(vertices, faces).query(points.T)[1]
    offsets, star = stars(faces, len(vertices))
    counts = np.diff(offsets)
    known = (survivor >= 0) & (counts.take(np.maximum(survivor, 0)) > 0)
    frames = triangle_frames(vertices, faces).astype(np.float32)
    face = np.empty(len(survivor), dtype=np.int64)
    for start in range(0, len(face), _BLOCK):
        rows = start + np.flatnonzero(known[start : start + _BLOCK])
        if len(rows):
            ends = np.cumsum(counts.take(survivor[rows]))
            size = counts.take(survivor[rows])
            place = np.arange(ends[-1]) + np.repeat(offsets.take(survivor[rows]) - ends + size, size)
            candidate = star.take(place)
            squared = squared_distances(frames.take(candidate, axis=1), points.take(np.repeat(rows, size), axis=1))
            far = squared > np.repeat(_as_near(np.minimum.reduceat(squared, ends - size)), size)
            face[rows] = np.minimum.reduceat(np.where(far, len(faces), candidate), ends - size)
    rest = np.flatnonzero(~known)
    if len(rest):
        face[rest] = ClosestPoints(vertices, faces).query(points.take(rest, axis=1).T)[1]
    return face


def _correspond(
    vertices: Floats, faces: Ints, points: Floats, face: Ints, neighbors: Ints
) -> tuple[Ints, Floats, Floats]:
    """Return the nearest of each sample's face and the faces across its sides, the squared distance and closest point.

    The surface moves little between rounds: one step to a neighbour follows it at a tenth of a full search.
    """
    frames = triangle_frames(vertices, faces).astype(np.float32)
    best, distance, closest = face.copy(), np.empty(len(face)), np.empty_like(points)
    for start in range(0, len(face), _BLOCK):
        part = slice(start, start + _BLOCK)
        here, local = best[part], points[:, part]
        nearest, squared, outside = closest_in_triangles(frames.take(here, axis=1), local)
        rows = np.flatnonzero(outside)
        present = here.take(rows)
        candidates = np.concatenate((present[None], neighbors.take(present, axis=1)))
        across = squared_distances(frames.take(candidates[1:], axis=1), local.take(rows, axis=1)[:, None])
        gaps = np.concatenate((squared.take(rows)[None], across))
        first = np.where(gaps > _as_near(gaps.min(axis=0)), len(faces), candidates).min(axis=0)
        moves = np.flatnonzero(first != present)
        rows, moved = rows.take(moves), first.take(moves)
        here[rows] = moved
        nearest[:, rows], squared[rows], _ = closest_in_triangles(frames.take(moved, axis=1), local.take(rows, axis=1))
        closest[:, part], distance[part] = nearest, squared
    return best, distance, closest


def _as_near(squared: Floats) -> Floats:
    """Return the squared distances that are no larger but for rounding.

    Faces are equally near to a sample above their edge: it takes the first of them, so that rounding decides nothing.
    """
    return (np.sqrt(squared) + _ROUNDING) ** 2


def _barycentric(vertices: Floats, faces: Ints, face: Ints, points: Floats) -> Floats:
    """Return (3, k) barycentric coordinates of (3, k) points on their faces."""
    columns = np.ascontiguousarray(vertices.T)
    a, b, c = (columns.take(faces[:, corner], axis=1) for corner in range(3))
    side, other = b - a, c - a
    # coordinates are linear in the point: two covectors and an origin a face are all that a sample needs
    aa, ab, bb = (side * side).sum(axis=0), (side * other).sum(axis=0), (other * other).sum(axis=0)
    scale = 1 / np.maximum(aa * bb - ab * ab, 1e-300)
    rows = np.concatenate([a, (bb * side - ab * other) * scale, (aa * other - ab * side) * scale])
    weights = np.empty((3, len(face)))
    for start in range(0, len(face), _BLOCK):
        part = slice(start, start + _BLOCK)
        local = rows.take(face[part], axis=1)
        offset = points[:, part] - local[:3]
        second = (offset * local[3:6]).sum(axis=0).clip(0, 1)
        third = (offset * local[6:]).sum(axis=0).clip(0, 1 - second)
        weights[:, part] = 1 - second - third, second, third
    return weights
