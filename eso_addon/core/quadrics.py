# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadric error metrics (Garland and Heckbert; paper one, Equations 1 to 3 and 9) for arrays of vertices and edges.

A quadric is a row of ten numbers, `a11 a12 a13 a22 a23 a33 b1 b2 b3 c`: the error at x is xᵀAx + 2bᵀx + c. Rows have
two spare columns: a gather of 96 bytes is faster than one of 80. Where attributes count, the first of these tells the
vertices on lines, and behind them are the sums that `reduced` needs.
"""

from collections.abc import Sequence

import numpy as np

from .mesh import Bools, Floats, Ints

# rows of a matrix, or a list of them
Components = np.ndarray | Sequence[np.ndarray]
WIDTH = 12
LINED = 10
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_DIAGONAL = (0, 3, 5)
# edges a block: two blocks of rows stay in the processor's second cache
_BLOCK = 8192
_TINY = 1e-30


def plane_quadrics(faces: Ints, normals: Floats, areas: Floats, count: int, *, area_weighted: bool) -> Floats:
    """Sum the squared-distance matrices of the faces around each vertex (Equations 1 to 3).

    Every plane goes through its own vertex, so relative to the vertex only the 3 by 3 part is not zero.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    normals, areas : ndarray, (3, m) and (m,) float64
        From `area_normals`.
    count : int
        Number of vertices, n.
    area_weighted : bool
        Weigh each plane by its face's area; without it by one, as the papers print it.

    Returns
    -------
    ndarray, (6, n) float64
        a11 a12 a13 a22 a23 a33.
    """
    scale = np.where(areas > 0, (areas if area_weighted else 1.0) / np.maximum(areas * areas, 1e-300), 0.0)
    parts = np.empty((6, count))
    scaled = normals * scale
    for part, (i, j) in zip(parts, PAIRS, strict=True):
        product = normals[i] * scaled[j]
        part[:] = sum(np.bincount(corner, product, count) for corner in faces)
    return parts


def area_normals(points: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Return (3, m) face normals of the length of the area, and the (m,) areas; points are (3, n), faces (3, m)."""
    rows = np.zeros((points.shape[1], 4))
    rows[:, :3] = points.T
    normals, areas = np.empty(faces.shape), np.empty(faces.shape[1])
    for start in range(0, faces.shape[1], _BLOCK):
        part = slice(start, start + _BLOCK)
        first = rows.take(faces[0, part], axis=0)
        one, two = (rows.take(corner[part], axis=0) - first for corner in faces[1:])
        for row, axis in zip(normals, cross(one.T, two.T), strict=True):
            np.multiply(axis, 0.5, out=row[part])
        x, y, z = normals[:, part]
        areas[part] = np.sqrt(x * x + y * y + z * z)
    return normals, areas


def cross(a: Components, b: Components) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cross product by components: a, b and the result are triples of arrays."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def boundary_quadrics(points: Floats, normals: Floats, edges: Ints, weight: float | Floats) -> Floats:
    """Planes through boundary edges, perpendicular to their faces, summed at both ends.

    Parameters
    ----------
    points : ndarray, (3, n) float64
    normals : ndarray, (3, b) float64
        Unit normal of the one face at each edge.
    edges : ndarray, (2, b) int64
    weight : float or ndarray, (b,) float64
        Each plane weighs so many times the squared length of its edge.

    Returns
    -------
    ndarray, (6, n) float64
    """
    along = points[:, edges[1]] - points[:, edges[0]]
    across = cross(along, normals)  # as long as the edge: its square is the weight by squared length
    parts = np.empty((6, points.shape[1]))
    for part, (i, j) in zip(parts, PAIRS, strict=True):
        part[:] = np.bincount(edges.ravel(), np.tile(weight * across[i] * across[j], 2), points.shape[1])
    return parts


def axis_plane_quadrics(points: Floats, planar: Bools, edges: Ints, weight: float) -> Floats:
    """Planes of two axes in which boundary edges lie, summed at both ends; arguments and result as above.

    `planar`, (3, b) bool, tells along which axes an edge is planar.
    """
    along = points[:, edges[1]] - points[:, edges[0]]
    squared = weight * (along * along).sum(axis=0)
    parts = np.zeros((6, points.shape[1]))
    for place, flags in zip(_DIAGONAL, planar, strict=True):
        parts[place] = np.bincount(edges.ravel(), np.tile(squared * flags, 2), points.shape[1])
    return parts


def anchored(parts: Floats, points: Floats, memory: float) -> Floats:
    """Turn 3 by 3 parts about each vertex into quadrics, with a faint memory of where the vertex stands.

    The memory, `memory` times the trace times the squared distance from the vertex, makes every system solvable and
    lets a flat region collapse its short edges first instead of in random order.

    Parameters
    ----------
    parts : ndarray, (6, n) float64
    points : ndarray, (3, n) float64
    memory : float

    Returns
    -------
    ndarray, (n, 12) float64
    """
    quadrics = np.empty((points.shape[1], WIDTH))
    columns = np.zeros((WIDTH, _BLOCK))
    for start in range(0, len(quadrics), _BLOCK):
        block = parts[:, start : start + _BLOCK]
        x, y, z = points[:, start : start + _BLOCK]
        q = columns[:, : block.shape[1]]
        q[:6] = block
        q[_DIAGONAL, :] += memory * (block[0] + block[3] + block[5]) + _TINY
        q[6] = -(q[0] * x + q[1] * y + q[2] * z)
        q[7] = -(q[1] * x + q[3] * y + q[4] * z)
        q[8] = -(q[2] * x + q[4] * y + q[5] * z)
        q[9] = -(q[6] * x + q[7] * y + q[8] * z)
        quadrics[start : start + _BLOCK] = q.T
    return quadrics


def move_memory(merged: Floats, one: Floats, other: Floats, starts: Floats, ends: Floats, places: Floats,
                memory: float) -> None:
    """Move the memory of merged quadrics from where the two vertices stood to where the one stands, in place.

    Parameters
    ----------
    merged : ndarray, (e, 12) float64
        Sum of `one` and `other`; changed.
    one, other : ndarray, (e, 12) float64
    starts, ends, places : ndarray, (3, e) float64
        Positions of the two vertices, and of the vertex that they became.
    memory : float
    """
    share = memory / (1 + 3 * memory)
    pull_one = share * one[:, _DIAGONAL].sum(axis=1)
    pull_other = share * other[:, _DIAGONAL].sum(axis=1)
    pull = pull_one + pull_other
    for axis in range(3):
        merged[:, 6 + axis] += pull_one * starts[axis] + pull_other * ends[axis] - pull * places[axis]
    merged[:, 9] += (pull * (places * places).sum(axis=0) - pull_one * (starts * starts).sum(axis=0)
                     - pull_other * (ends * ends).sum(axis=0))


def reduced(summed: Floats) -> np.ndarray:
    """Return the ten numbers of quadrics, (10, e), where attributes have the values that fit each place best.

    The sums behind column 12 are the weight of the faces, and for each value its weighted slope and what it is at the
    origin: to have one value costs how far those of the faces vary (Hoppe 1999, section 5, with the value eliminated).

    Parameters
    ----------
    summed : ndarray, (e, 12 or wider) float64
    """
    q = summed.T[:10]
    if summed.shape[1] == WIDTH:
        return q
    q = q.copy()
    weight = summed[:, WIDTH]
    share = np.where(weight > 0, 1 / np.where(weight > 0, weight, 1), 0)
    for column in range(WIDTH + 1, summed.shape[1] - 3, 4):
        terms = np.ascontiguousarray(summed.T[column : column + 4])
        scaled = terms * share
        for row, (i, j) in enumerate(PAIRS):
            q[row] -= terms[i] * scaled[j]
        q[6:10] -= terms * scaled[3]
    return q


def settle(merged: Floats) -> None:
    """Give attributes of vertices on lines their value for good, in place: the other side of a line has others."""
    if merged.shape[1] > WIDTH:
        lined = np.flatnonzero(merged[:, LINED] > 0)
        rows = merged.take(lined, axis=0)
        rows[:, :10] = reduced(rows).T
        rows[:, WIDTH:] = 0
        merged[lined] = rows


def _block(quadrics: Floats) -> int:
    return _BLOCK * WIDTH // quadrics.shape[1]


def _eliminate(q: np.ndarray) -> tuple[np.ndarray, ...]:
    """LDLᵀ of A with the pivots' inverses, and the forward substitution of b: stable where Cramer's rule is not."""
    a11, a12, a13, a22, a23, a33, b1, b2, b3, _ = q
    r1 = 1.0 / a11
    l21 = a12 * r1
    l31 = a13 * r1
    r2 = 1.0 / (a22 - l21 * a12)
    e23 = a23 - l31 * a12
    l32 = e23 * r2
    r3 = 1.0 / (a33 - l31 * a13 - l32 * e23)
    y2 = b2 - l21 * b1
    y3 = b3 - l31 * b1 - l32 * y2
    return l21, l31, l32, r1, r2, r3, y2, y3


def optimal_costs(quadrics: Floats, one: Ints, other: Ints) -> np.ndarray:
    """Return the least error of each edge's summed quadric, (e,) float32; `one`, `other` are (e,) vertices."""
    costs = np.empty(len(one), np.float32)
    block = _block(quadrics)
    for start in range(0, len(one), block):
        part = slice(start, start + block)
        summed = quadrics.take(one[part], axis=0)
        summed += quadrics.take(other[part], axis=0)
        q = reduced(summed)
        _, _, _, r1, r2, r3, y2, y3 = _eliminate(q)
        costs[part] = q[9] - q[6] * q[6] * r1 - y2 * y2 * r2 - y3 * y3 * r3
    return np.maximum(costs, 0, out=costs)


def optimal_places(summed: Floats) -> Floats:
    """Return where each summed quadric, (e, 12 or wider), is least: (3, e) float64."""
    q = reduced(summed)
    l21, l31, l32, r1, r2, r3, y2, y3 = _eliminate(q)
    z = -y3 * r3
    y = -y2 * r2 - l32 * z
    x = -q[6] * r1 - l21 * y - l31 * z
    return np.array((x, y, z))


def errors_at(summed: Floats, places: Floats) -> Floats:
    """Return the error of each quadric, (e, 12 or wider), at its place, (3, e): (e,) float64."""
    return _errors(reduced(summed), places)


def _errors(q: np.ndarray, places: Floats) -> Floats:
    a11, a12, a13, a22, a23, a33, b1, b2, b3, c = q
    x, y, z = places
    return (x * (a11 * x + 2 * (a12 * y + a13 * z + b1)) + y * (a22 * y + 2 * (a23 * z + b2))
            + z * (a33 * z + 2 * b3) + c)


def endpoint_costs(quadrics: Floats, points: Floats, one: Ints, other: Ints) -> tuple[np.ndarray, np.ndarray]:
    """Return each edge's summed quadric at its ends: (e,) float32 at `one` and at `other`; points are (n, 4) rows."""
    at_one = np.empty(len(one), np.float32)
    at_other = np.empty(len(one), np.float32)
    block = _block(quadrics)
    for start in range(0, len(one), block):
        part = slice(start, start + block)
        summed = quadrics.take(one[part], axis=0)
        summed += quadrics.take(other[part], axis=0)
        q = reduced(summed)
        at_one[part] = _errors(q, points.take(one[part], axis=0).T[:3])
        at_other[part] = _errors(q, points.take(other[part], axis=0).T[:3])
    return np.maximum(at_one, 0, out=at_one), np.maximum(at_other, 0, out=at_other)
