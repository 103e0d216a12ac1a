# SPDX-License-Identifier: GPL-3.0-or-later
"""What a collapse does to UV maps, normals and colours, as quadrics.

After Hoppe 1999, New quadric metric for simplifying meshes with appearance attributes. Each face says what a value is
anywhere by its own slope; a vertex costs how far the faces that it stands for disagree at its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .attributes import Layer
from .lines import Lines
from .mesh import Floats, Ints
from .quadrics import LINED, PAIRS, WIDTH, cross, reduced

# beside a distance of one across the surface: UV by the distance along the surface that it is off by, normals and
# colours by the size of the mesh
_WEIGHTS = {"uv": 0.15, "normal": 0.005, "color": 0.005}
# slopes so many times the mean count no more than that: slivers have any
_STEEP = 10.0
# maps with less slope, of their values over the mesh, say nothing: a palette's
_FLAT = 1e-6
# of its colours' alpha, and of more layers of a kind, the cost knows nothing
_MOST = 3


class _Slopes(NamedTuple):
    """Slopes, (j, 3, m), of j values on the faces, what they are at the origin, (j, m), and each face's share, (m,)."""

    slope: Floats
    start: Floats
    share: Floats


def with_attributes(quadrics: Floats, points: Floats, lines: Lines, layers: Sequence[tuple[Layer, Ints]],
                    weight: float, importance: Floats | None = None) -> Floats:
    """Add what attributes cost: only the first layer of a kind, and on either side of a line by itself.

    Parameters
    ----------
    quadrics : ndarray, (n, 12) float64
    points : ndarray, (3, n) float64
    lines : Lines
    layers : sequence of (Layer, ndarray)
        With the (3, m) elements at the faces' corners.
    weight : float
        All attributes count so many times as much.
    importance : ndarray, (n,) float64, optional
        And so many times as much at each vertex.

    Returns
    -------
    ndarray, (n, 12 or wider) float64
        See `quadrics.reduced`.
    """
    found = _slopes(points, lines.faces, layers, weight)
    if not found:
        return quadrics
    share = np.minimum.reduce([part.share for part in found])
    slope, start = (np.concatenate(rows) for rows in zip(*((part.slope, part.start) for part in found), strict=True))
    rows = _summed(slope, start, share, lines.wedge)
    vertex = np.zeros(len(rows), np.int64)
    vertex[lines.wedge] = lines.faces
    if importance is not None:
        rows *= importance.take(vertex)[:, None]
    lined = np.bincount(vertex, minlength=len(quadrics)) > 1
    lined[lines.edges] = True
    wide = np.zeros((len(quadrics), rows.shape[1]))
    wide[:, :WIDTH] = quadrics
    wide[lined, LINED] = 1
    # of several sides each has values of its own for good; elsewhere those of vertices that become one are weighed anew
    apart = lined.take(vertex)
    wide[vertex[~apart]] += rows[~apart]
    for column, part in enumerate(reduced(rows[apart])):
        wide[:, column] += np.bincount(vertex[apart], part, len(wide))
    return wide


def _slopes(points: Floats, faces: Ints, layers: Sequence[tuple[Layer, Ints]], weight: float) -> list[_Slopes]:
    a, b, c = (points.take(row, axis=1) for row in faces)
    one, other = b - a, c - a
    normals = np.stack(cross(one, other))
    square = (normals * normals).sum(axis=0)
    areas = np.sqrt(square) / 2
    proper = square > 1e-20 * ((one * one).sum(axis=0) * (other * other).sum(axis=0))
    scale = np.where(proper, 1 / np.where(proper, square, 1), 0)
    toward = np.stack(cross(other, normals)) * scale, np.stack(cross(normals, one)) * scale
    found: dict[str, _Slopes] = {}
    for layer, elements in layers:
        if layer.kind not in _WEIGHTS or layer.kind in found or layer.rows.shape[1] == 0:
            continue
        values = layer.rows[:, :_MOST].astype(np.float64)
        if layer.rows.dtype.kind in "iub":
            values /= np.iinfo(layer.rows.dtype).max if layer.rows.dtype.kind != "b" else 1
        first, second, third = ((values - values.mean(axis=0)).take(row, axis=0).T for row in elements)
        slope = ((second - first)[:, None] * toward[0] + (third - first)[:, None] * toward[1])
        steep = np.sqrt((slope * slope).sum(axis=(0, 1)))
        mean = float((steep * areas).sum() / max(float(areas.sum()), 1e-300))
        if mean <= _FLAT * float(np.abs(values).max(initial=0)):
            continue
        unit = weight * _WEIGHTS[layer.kind] / (mean if layer.kind == "uv" else 1)
        start = first - (slope * a).sum(axis=1)
        share = areas * proper * np.minimum(1, _STEEP * mean / np.maximum(steep, 1e-300)) ** 2
        found[layer.kind] = _Slopes(slope * unit, start * unit, share)
    return list(found.values())


def _summed(slope: Floats, start: Floats, share: Floats, wedge: Ints) -> Floats:
    """Return the rows of wedges: quadrics of the values by themselves, and the sums that `reduced` needs."""
    count = int(wedge.max(initial=-1)) + 1
    used = 1 + 4 * len(slope)
    rows = np.zeros((count, WIDTH + used + -used % 4))

    def put(column: int, values: Floats) -> None:
        rows[:, column] = sum(np.bincount(corner, values, count) for corner in wedge)

    for column, (i, j) in enumerate(PAIRS):
        put(column, share * (slope[:, i] * slope[:, j]).sum(axis=0))
    for axis in range(3):
        put(6 + axis, share * (slope[:, axis] * start).sum(axis=0))
    put(9, share * (start * start).sum(axis=0))
    put(WIDTH, share)
    for number, (toward, offset) in enumerate(zip(slope, start, strict=True)):
        for axis in range(3):
            put(WIDTH + 1 + 4 * number + axis, share * toward[axis])
        put(WIDTH + 4 + 4 * number, share * offset)
    return rows
