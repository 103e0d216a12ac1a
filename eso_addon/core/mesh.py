# SPDX-License-Identifier: GPL-3.0-or-later
"""What a valid triangle mesh is, and the two mends that come before anything else: weld and spatial order."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import MeshError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def check_mesh(vertices: ArrayLike, faces: ArrayLike) -> tuple[Floats, Ints]:
    """Return the mesh as contiguous arrays, or say what is wrong with it.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Positions, any real dtype. Coordinates that a face uses must be finite.
    faces : array_like, (m, 3)
        Vertex indices, any integer dtype. May be empty.

    Returns
    -------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64

    Raises
    ------
    MeshError
        Wrong shape or dtype, an index out of range, a coordinate that is not finite.
    """
    points = _array(vertices, "vertices", "(n, 3) numbers")
    corners = _array(faces, "faces", "(m, 3) integers")
    if points.size == 0:
        points = np.zeros((0, 3))
    if corners.size == 0:
        corners = np.zeros((0, 3), np.int64)
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise MeshError(f"vertices must be an (n, 3) array of numbers, not {points.shape} {points.dtype}")
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise MeshError(f"faces must be an (m, 3) array: triangulate polygons first (got {corners.shape})")
    if corners.dtype.kind not in "iu":
        raise MeshError(f"faces must hold integers, not {corners.dtype}")
    points = np.ascontiguousarray(points, np.float64)
    corners = np.ascontiguousarray(corners, np.int64)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
        face = int(np.flatnonzero(((corners < 0) | (corners >= len(points))).any(axis=1))[0])
        raise MeshError(f"face {face} names a vertex that is not there ({len(points)} vertices): repair the faces")
    if not np.isfinite(points).all():
        used = np.zeros(len(points), bool)
        used[corners] = True
        broken = np.flatnonzero(used & ~np.isfinite(points).all(axis=1))
        if len(broken):
            raise MeshError(
                f"vertex {broken[0]} has a coordinate that is not finite ({len(broken)} such): delete or mend it"
            )
    return points, corners


def _array(values: ArrayLike, name: str, wanted: str) -> NDArray:
    try:
        return np.asarray(values)
    except ValueError:
        raise MeshError(f"{name} must be an array of {wanted}: its rows differ in length") from None


def weld(vertices: Floats) -> Ints:
    """Find vertices at equal positions.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64

    Returns
    -------
    representative : ndarray, (n,) int64
        The lowest index among the vertices at the same position; its own index for a vertex that stands alone.
    """
    order, new = morton_weld(vertices)
    heads = np.flatnonzero(new)
    representative = np.empty(len(vertices), np.int64)
    representative[order] = np.repeat(order.take(heads), np.diff(np.append(heads, len(order))))
    return representative


def hashes(count: int) -> NDArray[np.uint64]:
    """Return (count,) numbers without pattern, one for each index: sums of them tell sets of indices apart."""
    mixed = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    return (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)


def bounds(points: Floats) -> tuple[Floats, Floats]:
    """Return the least and the greatest coordinates, (3,) each, of (n, 3) points: by columns, many times as quick."""
    return np.array([axis.min() for axis in points.T]), np.array([axis.max() for axis in points.T])


def morton_order(points: Floats) -> Ints:
    """Order points along a Morton curve, so that neighbours in space are neighbours in memory.

    Parameters
    ----------
    points : ndarray, (n, 3) float64

    Returns
    -------
    order : ndarray, (n,) int64
        The points' indices along the curve; equal codes keep the order of their indices.
    """
    return _morton_sorted(points)[0]


def morton_weld(points: Floats) -> tuple[Ints, Bools]:
    """Order points along a Morton curve, equal positions together.

    Parameters
    ----------
    points : ndarray, (n, 3) float64

    Returns
    -------
    order : ndarray, (n,) int64
    new : ndarray, (n,) bool
        Along the order, where another position than the one before begins.
    """
    order, codes = _morton_sorted(points)
    new = np.ones(len(order), bool)
    tied = np.flatnonzero(codes[1:] == codes[:-1])
    if len(tied) == 0:
        return order, new
    equal = (points.take(order.take(tied + 1), axis=0) == points.take(order.take(tied), axis=0)).all(axis=1)
    if not equal.all():  # equal positions may have others of their cell between them
        cell = np.zeros(len(order), bool)
        cell[tied] = cell[tied + 1] = True
        places = np.flatnonzero(cell)
        x, y, z = points.take(order.take(places), axis=0).T
        order[places] = order.take(places).take(np.lexsort((order.take(places), z, y, x, codes.take(places))))
        equal = (points.take(order.take(tied + 1), axis=0) == points.take(order.take(tied), axis=0)).all(axis=1)
    new[tied.compress(equal) + 1] = False
    return order, new


def _morton_sorted(points: Floats) -> tuple[Ints, Ints]:
    if len(points) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    index_bits = max(len(points) - 1, 1).bit_length()
    axis_bits = min((63 - index_bits) // 3, 16)
    low, high = bounds(points)
    with np.errstate(over="ignore"):
        extent = float((high - low).max())
    # an extent beyond the largest number or next to none gives no order, and no harm
    scale = (2**axis_bits - 1) / extent if 1e-290 < extent < np.inf else 0.0
    keys = np.zeros(len(points), np.int64)
    for axis in range(3):
        cell = ((points[:, axis] - low[axis]) * scale).astype(np.int64) if scale else np.zeros(len(points), np.int64)
        keys |= _spread(cell) << axis
    keys <<= index_bits
    keys |= np.arange(len(points))
    keys.sort()
    return keys & ((1 << index_bits) - 1), keys >> index_bits


def _spread(values: Ints) -> Ints:
    """Put two zero bits between the bits of 16-bit values."""
    for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F),
                        (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):
        values = (values | (values << shift)) & mask
    return values
