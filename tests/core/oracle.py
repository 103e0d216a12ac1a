# SPDX-License-Identifier: GPL-3.0-or-later
"""The oracle of the engine: an exact edge collapse, one at a time off a heap, slow and obvious.

A quadric is ten numbers in absolute coordinates, xx xy xz yy yz zz x y z 1: the error at x is
x'Ax + 2b'x + c with A the first six, b the next three and c the last.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float, float]
Quadric = tuple[float, ...]
Place = Callable[[Quadric, Point, Point], tuple[float, Point]]


class OracleResult(NamedTuple):
    """What is left, and the collapses in their order: (kept, removed) and their costs."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    collapses: list[tuple[int, int]]
    costs: list[float]


def plane_quadrics(points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quadric of the squared distance to each plane (Equations 1 and 3): (k, 10)."""
    a, b, c = normals.T
    d = -np.einsum("ij,ij->i", points, normals)
    return np.stack((a * a, a * b, a * c, b * b, b * c, c * c, a * d, b * d, c * d, d * d), axis=1)


def initial_quadrics(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    weights: NDArray[np.float64] | None = None,
    power: float = 1.0,
    area_weighted: bool = True,
    boundary: float = 0.0,
) -> NDArray[np.float64]:
    """Return weight ** power times the sum of the planes of each vertex's faces (Equation 9): (n, 10).

    `area_weighted` weighs a plane by a third of its face's area, otherwise it counts one. `boundary` times the
    squared length weighs the plane through a boundary edge that stands on its face.
    """
    quadrics = np.zeros((len(vertices), 10))
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    normals = cross / np.where(double > 0.0, double, 1.0)[:, None]
    planes = plane_quadrics(a, normals)
    if area_weighted:
        planes *= double[:, None] / 6.0
    for i in range(3):
        np.add.at(quadrics, faces[:, i], planes)
    if boundary > 0.0:
        met: dict[frozenset[int], list[tuple[int, int, int]]] = {}
        for face, corners in enumerate(faces.tolist()):
            for i in range(3):
                u, v = corners[i], corners[(i + 1) % 3]
                met.setdefault(frozenset((u, v)), []).append((u, v, face))
        for sides in met.values():
            if len(sides) == 1:
                u, v, face = sides[0]
                along = vertices[v] - vertices[u]
                length = float(np.linalg.norm(along))
                if length > 0.0:
                    across = np.cross(along / length, normals[face])
                    wall = boundary * length**2 * plane_quadrics(vertices[u][None], across[None])[0]
                    quadrics[u] += wall
                    quadrics[v] += wall
    if weights is not None:
        quadrics *= (weights**power)[:, None]
    return quadrics


def error_at(quadric: Quadric, point: Point) -> float:
    """Return the quadric's value at a point (Equation 2)."""
    xx, xy, xz, yy, yz, zz, bx, by, bz, c = quadric
    x, y, z = point
    return (
        x * (xx * x + 2.0 * (xy * y + xz * z + bx)) + y * (yy * y + 2.0 * (yz * z + by)) + z * (zz * z + 2.0 * bz) + c
    )


def optimal(quadric: Quadric, u: Point, v: Point) -> tuple[float, Point]:
    """Return the least error and where it is; the best of both ends and the middle where that is not sure."""
    xx, xy, xz, yy, yz, zz, bx, by, bz, _ = quadric
    cof_x, cof_y, cof_z = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = xx * cof_x + xy * cof_y + xz * cof_z
    trace = xx + yy + zz
    candidates = [u, v, ((u[0] + v[0]) / 2, (u[1] + v[1]) / 2, (u[2] + v[2]) / 2)]
    if det > 1e-9 * trace**3:
        best = (
            -(cof_x * bx + cof_y * by + cof_z * bz) / det,
            -(cof_y * bx + (xx * zz - xz * xz) * by + (xy * xz - xx * yz) * bz) / det,
            -(cof_z * bx + (xy * xz - xx * yz) * by + (xx * yy - xy * xy) * bz) / det,
        )
        candidates = [best]
    return min((max(error_at(quadric, point), 0.0), point) for point in candidates)


def endpoint(quadric: Quadric, u: Point, v: Point) -> tuple[float, Point]:
    """Return the lesser error of both ends, and that end."""
    return min((max(error_at(quadric, point), 0.0), point) for point in (u, v))


class _Mesh:
    """Faces by number, and for each vertex its faces."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        # one origin for all, near the mesh: absolute quadrics lose digits far from it
        self.points: list[Point] = [tuple(p) for p in vertices.tolist()]  # type: ignore[misc]
        self.faces: dict[int, list[int]] = dict(enumerate(faces.tolist()))
        self.stars: list[set[int]] = [set() for _ in self.points]
        for face, corners in self.faces.items():
            for corner in corners:
                self.stars[corner].add(face)

    def ring(self, v: int) -> set[int]:
        return {corner for face in self.stars[v] for corner in self.faces[face]} - {v}

    def link(self, v: int) -> set[frozenset[int]]:
        """Return the link of a vertex as vertices and edges, with -1 standing for what is beyond a boundary."""
        edges = [frozenset(self.faces[face]) - {v} for face in self.stars[v]]
        met: dict[int, int] = {}
        for edge in edges:
            for w in edge:
                met[w] = met.get(w, 0) + 1
        link = {frozenset((w,)) for w in met} | set(edges)
        for w, times in met.items():
            if times == 1:
                link |= {frozenset((-1,)), frozenset((w, -1))}
        return link

    def edge_link(self, u: int, v: int) -> set[frozenset[int]]:
        faces = self.stars[u] & self.stars[v]
        link = {frozenset(self.faces[face]) - {u, v} for face in faces}
        return link | {frozenset((-1,))} if len(faces) == 1 else link

    def keeps_topology(self, u: int, v: int) -> bool:
        """Return whether the link condition holds."""
        return self.link(u) & self.link(v) == self.edge_link(u, v)

    def flips(self, u: int, v: int, point: Point, least_cosine: float) -> bool:
        """Return whether a face that stays would turn by more than allowed, or lose its area."""
        for end in (u, v):
            for face in self.stars[end] - self.stars[v if end == u else u]:
                corners = self.faces[face]
                before = _cross(*(self.points[w] for w in corners))
                after = _cross(*(point if w == end else self.points[w] for w in corners))
                dot = before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
                size = _dot(before) * _dot(after)
                if _dot(before) > 0.0 and dot <= least_cosine * size**0.5:
                    return True
        return False

    def collapse(self, u: int, v: int, point: Point) -> None:
        """Move u to the point and let v go into it."""
        for face in self.stars[u] & self.stars[v]:
            for w in self.faces.pop(face):
                self.stars[w].discard(face)
        for face in self.stars[v]:
            self.faces[face] = [u if w == v else w for w in self.faces[face]]
        self.stars[u] |= self.stars[v]
        self.stars[v] = set()
        self.points[u] = point


def _cross(a: Point, b: Point, c: Point) -> Point:
    ux, uy, uz, vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def _dot(v: Point) -> float:
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def oracle_simplify(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    quadrics: NDArray[np.float64],
    faces_target: int,
    *,
    place: Place = optimal,
    link_condition: bool = True,
    least_cosine: float = 0.0,
) -> OracleResult:
    """Collapse the cheapest edge that passes the tests until no more than `faces_target` triangles are left.

    Parameters
    ----------
    vertices : (n, 3) positions
    faces : (m, 3) triangles
    quadrics : (n, 10) of the vertices to begin with; an edge costs the least value of the sum of its ends'
    faces_target : number of triangles
    place : gives cost and position from a quadric and the two ends
    link_condition : whether collapses that change the topology are refused
    least_cosine : a collapse that turns a face by a lesser cosine is refused
    """
    origin = vertices[np.unique(faces)].mean(axis=0) if len(faces) else np.zeros(3)
    mesh = _Mesh(vertices - origin, faces)
    sums: list[Quadric] = [tuple(q) for q in moved(quadrics, origin).tolist()]
    heap: list[tuple[float, int, int, int, Point]] = []
    current: dict[tuple[int, int], int] = {}  # the last entry of each edge in the heap, all others are stale
    entries = itertools.count()
    refused: list[set[int]] = [set() for _ in mesh.points]

    def push(u: int, v: int) -> None:
        u, v = min(u, v), max(u, v)
        total = tuple(a + b for a, b in zip(sums[u], sums[v], strict=True))
        cost, point = place(total, mesh.points[u], mesh.points[v])
        current[u, v] = entry = next(entries)
        heapq.heappush(heap, (cost, u, v, entry, point))

    for u in range(len(mesh.points)):
        for v in mesh.ring(u):
            if u < v:
                push(u, v)
    collapses: list[tuple[int, int]] = []
    costs: list[float] = []
    while heap and len(mesh.faces) > faces_target:
        cost, u, v, entry, point = heapq.heappop(heap)
        if current.get((u, v)) != entry or not mesh.stars[u] & mesh.stars[v]:
            continue
        del current[u, v]
        if mesh.flips(u, v, point, least_cosine) or (link_condition and not mesh.keeps_topology(u, v)):
            refused[u].add(v)
            refused[v].add(u)
            continue
        before = mesh.ring(u) | mesh.ring(v)
        mesh.collapse(u, v, point)
        collapses.append((u, v))
        costs.append(cost)
        sums[u] = tuple(a + b for a, b in zip(sums[u], sums[v], strict=True))
        ring = mesh.ring(u)
        for w in before - {u}:
            current.pop((min(v, w), max(v, w)), None)
        for w in ring:
            push(u, w)
        for w in before - {u, v}:  # what was refused near by may pass now
            for x in refused[w] & mesh.ring(w) - {u}:
                refused[x].discard(w)
                push(w, x)
            refused[w].clear()
        refused[u].clear()
        refused[v].clear()
    left = np.array(list(mesh.faces.values()), dtype=np.int64).reshape(-1, 3)
    kept, corners = np.unique(left, return_inverse=True)
    points = np.array(mesh.points).reshape(-1, 3)[kept] + origin
    return OracleResult(points, corners.reshape(-1, 3), collapses, costs)


def moved(quadrics: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quadrics for coordinates counted from another origin; (n, 3) origins move each to its own.

    With origins of minus each vertex it turns quadrics relative to their own vertex into absolute ones.
    """
    xx, xy, xz, yy, yz, zz, bx, by, bz, c = quadrics.T
    x, y, z = np.broadcast_to(origin, (len(quadrics), 3)).T
    nx, ny, nz = xx * x + xy * y + xz * z + bx, xy * x + yy * y + yz * z + by, xz * x + yz * y + zz * z + bz
    constant = c + x * (nx + bx) + y * (ny + by) + z * (nz + bz)
    return np.stack((xx, xy, xz, yy, yz, zz, nx, ny, nz, constant), axis=1)


def paper_preset(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], weights: NDArray[np.float64], faces_target: int
) -> OracleResult:
    """Simplify by Equations 8 and 9 as printed: unit planes, weights once, optimal placement, a flip test."""
    quadrics = initial_quadrics(vertices, faces, weights=weights, area_weighted=False)
    return oracle_simplify(vertices, faces, quadrics, faces_target, link_condition=False)
