# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a new vertex is expected, in whole numbers alone, so that every reader computes the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.mesh import Ints
from .coder import CLASSES, Reader, Writer, code_numbers, size_class
from .fans import Fans
from .models import Model
from .splits import Arcs

# the grid of predictions: coordinates below 2 to this
GRID_BITS = 25
# scores and normals use coordinates of so many bits, so that products stay exact in double precision
_SHORT_BITS = 17
# no sound number on a grid is as large as this: what damage makes larger is cut, so that products stay in 64 bits
_FAR = 1 << 27


@dataclass(frozen=True)
class Grid:
    """How coordinates are told apart: as multiples of a step, or as floats in their order.

    Attributes
    ----------
    kind : int
        0: coordinate = float32(number * scale), 1: coordinate = float32(number / scale), both with `origin` added to
        the product in double precision; 2: the number is the float's place among all floats.
    scale : float
    origin : tuple of float
    shift : int
        Prediction coordinates lose so many bits for scores.
    """

    kind: int
    scale: float
    origin: tuple[float, float, float]
    shift: int

    def floats(self, numbers: Ints) -> np.ndarray:
        """Return the coordinates of (n, 3) numbers, float32."""
        if self.kind == 2:
            return float_at(numbers)
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = numbers * self.scale if self.kind == 0 else numbers / self.scale
            return (scaled + np.array(self.origin)).astype(np.float32)

    def predictors(self, numbers: Ints) -> Ints:
        """Return the coordinates on the grid of predictions, (n, 3) int64."""
        if self.kind != 2:
            return numbers
        with np.errstate(invalid="ignore"):  # a signalling NaN
            values = float_at(numbers).astype(np.float64)
        values[~np.isfinite(values)] = 0.0
        return np.rint(np.clip(values * self.scale, -_FAR, _FAR)).astype(np.int64)


def place_of(values: np.ndarray) -> Ints:
    """Return the place of float32 numbers in their order, as int64: all bit patterns are told apart."""
    return _reflected(np.ascontiguousarray(values, np.float32).view(np.int32)).astype(np.int64)


def float_at(places: Ints) -> np.ndarray:
    """Return the float32 numbers at places in their order."""
    return _reflected(places.astype(np.int32)).view(np.float32)


def _reflected(bits: NDArray[np.int32]) -> NDArray[np.int32]:
    """Turn the order of negative numbers around: of floats' bits it makes places, and of places the bits."""
    return bits ^ ((bits >> 31) & 0x7FFFFFFF)


class Shape:
    """Adaptive models of positions."""

    def __init__(self) -> None:
        self.models = [Model(CLASSES, CLASSES, shared=True) for _ in range(3)]


def arc_normals(points: Ints, fans: Fans, arcs: Arcs, vertex: Ints, shift: int) -> Ints:
    """Return the sum of the normals of each split's arc, scaled to below 2 to the 12th: (3, k) int64."""
    following, preceding = fans.following.take(arcs.corner), fans.preceding.take(arcs.corner)
    p, q = np.empty((3, len(arcs.corner)), np.int64), np.empty((3, len(arcs.corner)), np.int64)
    for axis, row in enumerate(points):
        center = row.take(vertex).take(arcs.split)
        np.right_shift(row.take(following) - center, shift, out=p[axis])
        np.right_shift(row.take(preceding) - center, shift, out=q[axis])
    normal = np.empty((3, len(vertex)), np.int64)
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        normal[axis] = np.bincount(arcs.split, p[j] * q[k] - p[k] * q[j], len(vertex))
    length = np.abs(normal).max(axis=0, initial=0)
    excess = np.maximum(np.frexp(length.astype(np.float64))[1].astype(np.int64) - 12, 0)
    return normal >> excess


def ring_means(points: Ints, fans: Fans, arcs: Arcs, vertex: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the vertices that split and the means over the new ones' rings, (3, k), and how far these spread, (k,)."""
    count = len(vertex)
    ring = fans.preceding.take(arcs.corner)
    size = np.bincount(arcs.split, minlength=count) + 2
    center, mean = np.empty((3, count), np.int64), np.empty((3, count), np.int64)
    spread = np.zeros(count, np.int64)
    for axis, row in enumerate(points):
        around, first = row.take(ring), row.take(arcs.first_ring)
        center[axis] = row.take(vertex)
        total = center[axis] + first
        total += np.bincount(arcs.split, around, count).astype(np.int64)
        total *= 2
        total += size
        mean[axis] = total // (2 * size)
        around -= mean[axis].take(arcs.split)
        spread += np.bincount(arcs.split, np.abs(around), count).astype(np.int64)
        spread += np.abs(center[axis] - mean[axis]) + np.abs(first - mean[axis])
    return center, mean, spread // size


def code_positions(coder: Writer | Reader, shape: Shape, grid: Grid, points: Ints, fans: Fans, arcs: Arcs,
                   vertex: Ints, known: Ints | None) -> Ints:
    """Write or read the numbers of the new vertices' coordinates: (3, k) int64.

    The two coordinates across the surface's normal come first, against the mean of the ring; the one along it last,
    against the plane of the arc through the old vertex, where the first two put it.

    Parameters
    ----------
    points : ndarray, (3, n) int64
        On the grid of predictions.
    known : ndarray, (3, k) int64, or None
    """
    center, mean, spread = ring_means(points, fans, arcs, vertex)
    normal = arc_normals(points, fans, arcs, vertex, grid.shift)
    axis = np.abs(normal).argmax(axis=0)
    columns = np.arange(len(vertex))
    values = np.zeros((3, len(vertex)), np.int64)
    lean = np.zeros(len(vertex), np.int64)
    scale = spread
    for step, model in enumerate(shape.models):
        at = (axis + 1 + step) % 3
        expected, here = mean[at, columns], center[at, columns]
        if step == 2:
            divisor = normal[at, columns]
            divisor[divisor == 0] = 1
            expected = here - lean // divisor
        number, place = _code_one(coder, model, grid, expected, scale, None if known is None else known[at, columns])
        values[at, columns] = number
        if step < 2:
            lean += normal[at, columns] * (place - here)
            scale = (spread + 3 * np.abs(place - expected) + 1) >> 1
    return values


def _code_one(coder: Writer | Reader, model: Model, grid: Grid, expected: Ints, scale: Ints,
              known: Ints | None) -> tuple[Ints, Ints]:
    """Code one coordinate of each new vertex; return its number and its place on the grid of predictions."""
    if grid.kind == 2:
        guess = (expected / grid.scale).astype(np.float32)
        base = place_of(guess)
        # a step of the grid is worth so many floats, as a power of two: about 2 to the (23 - exponent) per unit
        exponent = np.frexp(np.abs(expected).astype(np.float64) + scale)[1].astype(np.int64)
        context = np.clip(size_class(scale)[0] + 2 * (24 - exponent), 0, CLASSES - 1)
    else:
        base = expected
        context = np.minimum(size_class(scale)[0], CLASSES - 1)
    rest = code_numbers(coder, model, context, None if known is None else known - base)
    number = rest + base
    if grid.kind == 2:
        number = np.clip(number, -(1 << 31), (1 << 31) - 1)
        return number, grid.predictors(number)
    number = np.clip(number, -_FAR, _FAR)
    return number, number


def lossless_grid(positions: np.ndarray) -> tuple[Grid, Ints]:
    """Choose the coarsest way to write float32 positions exactly.

    Parameters
    ----------
    positions : ndarray, (n, 3) float32
    """
    finite = positions[np.isfinite(positions).all(axis=1)].astype(np.float64)
    largest = float(np.abs(finite).max(initial=0.0))
    exponent = int(np.frexp(largest)[1]) if largest > 0 else 0
    if len(finite) == len(positions):
        steps = [(1, 10.0**digits) for digits in range(9)]
        steps += [(0, 2.0 ** (exponent - bits)) for bits in (12, 16, 20, 24)]
        some = slice(None, None, max(len(finite) // 64, 1))
        for kind, scale in steps:
            grid = Grid(kind, scale, (0.0, 0.0, 0.0), 0)
            if _numbers(grid, finite[some], positions[some]) is not None:  # few grids get beyond a sample
                numbers = _numbers(grid, finite, positions)
                if numbers is not None:
                    return _shifted(grid, numbers), numbers
    grid = Grid(2, float(np.ldexp(1.0, GRID_BITS - 1 - exponent)), (0.0, 0.0, 0.0), 0)
    numbers = place_of(positions)
    return _shifted(grid, grid.predictors(numbers)), numbers


def _numbers(grid: Grid, values: np.ndarray, positions: np.ndarray) -> Ints | None:
    """Return the numbers of positions on a grid, None where they are not on it or too far out."""
    scaled = values * grid.scale if grid.kind == 1 else values / grid.scale
    if np.abs(scaled).max(initial=0.0) >= 1 << GRID_BITS:
        return None
    numbers = np.rint(scaled).astype(np.int64)
    return numbers if np.array_equal(grid.floats(numbers).view(np.uint32), positions.view(np.uint32)) else None


def quantised_grid(positions: np.ndarray, bits: int) -> tuple[Grid, Ints]:
    """Lay a grid of 2 to the `bits` steps over the longest side of the bounding box."""
    values = positions.astype(np.float64)
    low, high = values.min(axis=0, initial=np.inf), values.max(axis=0, initial=-np.inf)
    extent = float((high - low).max()) if len(values) else 0.0
    step = extent / ((1 << bits) - 1) if extent > 0 else 1.0
    numbers = np.rint((values - low) / step).astype(np.int64) if len(values) else np.zeros((0, 3), np.int64)
    origin = (float(low[0]), float(low[1]), float(low[2])) if len(values) else (0.0, 0.0, 0.0)
    return _shifted(Grid(0, step, origin, 0), numbers), numbers


def _shifted(grid: Grid, predictors: Ints) -> Grid:
    spread = int((predictors.max(axis=0) - predictors.min(axis=0)).max()) if len(predictors) else 0
    return Grid(grid.kind, grid.scale, grid.origin, max(spread.bit_length() - _SHORT_BITS, 0))

