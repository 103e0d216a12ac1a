# SPDX-License-Identifier: GPL-3.0-or-later
"""Where attributes have lines: seams, material borders and sharp edges (Chen and Nishita, section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .adjacency import components
from .attributes import AttributeSet, Layer
from .features import side_pairs
from .mesh import Bools, Ints
from .prepare import Prepared

SEAM, MATERIAL, SHARP = 1, 2, 4
# two values at a corner are one where they differ by less than this part of the layer's range
_NEAR = {"uv": 1e-5, "color": 0.02, "value": 1e-3}
# normals closer than five degrees are one
_NEAR_NORMAL = np.cos(np.radians(5))
# UV triangles with less area than this part of their sides' squares run neither way
_THIN = 1e-3
# a layer that jumps at more of the edges has no lines, it is broken up everywhere
_MOST = 0.5


@dataclass(frozen=True, eq=False)
class Lines:
    """The edges between two faces, and which of them are lines.

    Sides are slots j * m + face of the (3, m) faces, as everywhere in the engine.

    Attributes
    ----------
    faces : ndarray, (3, m) int64
    corner : ndarray, (3, m) int64
        The input's corner, 3 * face + number, at each corner.
    pairs : ndarray, (4, e) int64
        The corners at each edge's two ends in one face, and at the same two ends in the other.
    kinds : ndarray, (e,) uint8
        0 where an edge is no line, else bits of SEAM, MATERIAL and SHARP.
    opened : ndarray, (n,) bool
        Vertices at boundaries and odd edges, where faces may be parted without a line.
    scattered : tuple of str
        Layers that have no lines because they have nothing else.
    """

    faces: Ints
    corner: Ints
    pairs: Ints
    kinds: np.ndarray
    opened: Bools
    scattered: tuple[str, ...]

    @property
    def messages(self) -> tuple[str, ...]:
        """What a user should know."""
        return tuple(f"{name} differs across most edges: it is carried, but holds none of them"
                     for name in self.scattered)

    @property
    def edges(self) -> Ints:
        """The vertices of the line edges, (2, s) int64."""
        return self.faces.ravel().take(self.pairs[:2].compress(self.kinds > 0, axis=1))

    def along(self, bits: int) -> Ints:
        """Return the vertices on lines of these kinds."""
        return np.unique(self.faces.ravel().take(self.pairs[:2].compress((self.kinds & bits) > 0, axis=1)))

    def unbroken(self, layer: Layer, elements: Ints) -> Ints:
        """Return corners, (2, k) int64 slots, that are joined across a line which a layer does not jump at.

        The layer's elements, (3, m) int64, are those at the corners of the faces.
        """
        pairs = self.pairs.compress(self.kinds > 0, axis=1)
        pairs = pairs.compress(~_jumps(layer, elements.ravel().take(pairs)), axis=1)
        return np.concatenate((pairs[0::2], pairs[1::2]), axis=1)

    @cached_property
    def parted(self) -> Bools:
        """(n,) bool: vertices whose corners may be of several wedges."""
        parted = self.opened.copy()
        parted[self.edges] = True
        return parted

    @cached_property
    def wedge(self) -> Ints:
        """(3, m) int64: the wedge of each corner, which lines part from the other wedges at its vertex.

        Numbered from 0.
        """
        faces = self.faces.ravel()
        count = len(self.opened)
        corners = np.flatnonzero(self.parted.take(faces))
        wedge = faces.copy()
        if len(corners):
            number = np.full(len(faces), -1)
            number[corners] = np.arange(len(corners))
            one, other = self._smooth_links(number)
            wedge[corners] = count + components(len(corners), one, other)
        return np.unique(wedge, return_inverse=True)[1].reshape(self.faces.shape)

    def _smooth_links(self, number: Ints) -> tuple[Ints, Ints]:
        """Return the corners that an edge which is no line joins, where both have a number."""
        smooth = self.pairs.compress(self.kinds == 0, axis=1)
        one, other = number.take(smooth[:2].ravel()), number.take(smooth[2:].ravel())
        there = (one >= 0) & (other >= 0)
        return one[there], other[there]


def find_lines(mesh: Prepared, input_faces: Ints, attributes: AttributeSet, ignored: int = 0) -> Lines:
    """Find the lines of a mesh.

    Parameters
    ----------
    mesh : Prepared
    input_faces : ndarray, (k, 3) int64
    attributes : AttributeSet
    ignored : int
        Kinds that are no lines, as bits.

    Returns
    -------
    Lines
    """
    faces, count = mesh.faces, mesh.points.shape[1]
    corner = mesh.face * 3 + np.arange(3)[:, None]
    if mesh.turned is not None:
        corner[1:, mesh.turned] = corner[:0:-1, mesh.turned]
    keys, (one, other) = side_pairs(faces, count)
    pairs = _corners_of(faces, one, other)
    kinds = np.zeros(len(one), np.uint8)
    scattered = []
    at_corner = {"corner": corner.ravel(), "face": np.tile(mesh.face, 3),
                 "vertex": input_faces.ravel().take(corner).ravel()}
    for layer in attributes.layers:
        bits = _bits(layer) & ~ignored
        if bits == 0 or (layer.domain == "vertex" and mesh.sheet is None and layer.kind != "uv"):
            continue
        if layer.domain == "edge":
            found = _marked(layer, mesh.vertex.take(attributes.edges), keys.take(one), count)
        else:
            found = _jumps(layer, at_corner[layer.domain].take(pairs))
            if layer.kind == "uv":
                found |= _folds(layer, at_corner[layer.domain].reshape(faces.shape), pairs)
        if found.sum() > max(_MOST * len(found), 12):
            scattered.append(layer.name)
        else:
            kinds[found] |= bits
    return Lines(faces, corner, pairs, kinds, mesh.opened, tuple(scattered))


def _corners_of(faces: Ints, one: Ints, other: Ints) -> Ints:
    """Return the corners at both ends of edges in their two faces: (4, e)."""
    width, corners = faces.shape[1], faces.ravel()
    start, end = one, (one + width) % len(corners)
    back, ahead = other, (other + width) % len(corners)
    same = corners.take(start) == corners.take(back)
    return np.stack((start, end, np.where(same, back, ahead), np.where(same, ahead, back)))


def _bits(layer: Layer) -> int:
    """Return the kind of line that a layer makes."""
    if layer.domain == "edge":
        return {"seam": SEAM, "sharp": SHARP}.get(layer.kind, 0)
    if layer.domain == "face":
        return {"material": MATERIAL, "sharp": SHARP}.get(layer.kind, 0)
    return SHARP if layer.kind == "normal" else SEAM


def _marked(layer: Layer, edges: Ints, keys: Ints, count: int) -> Bools:
    """Tell the edges, given by ascending keys, that a mark is on."""
    chosen = edges[(layer.rows != 0).any(axis=1)]
    wanted = chosen.min(axis=1) * count + chosen.max(axis=1)
    wanted = wanted[chosen.min(axis=1) >= 0]
    found = np.zeros(len(keys), bool)
    if len(keys):
        place = np.searchsorted(keys, wanted).clip(max=len(keys) - 1)
        found[place[keys.take(place) == wanted]] = True
    return found


def _jumps(layer: Layer, elements: Ints) -> Bools:
    """Tell the edges across which values differ at either end; elements as `Lines.pairs`."""
    found = np.zeros(elements.shape[1], bool)
    rows = layer.rows
    near = _NEAR.get(layer.kind, 0.0)
    if near and rows.size:
        near *= float(rows.max() - rows.min()) if layer.kind != "color" else max(float(np.abs(rows).max()), 1e-30)
    for end in (0, 1):
        # most corners share their value's row, or follow one that does: only those that differ are weighed
        one, other = elements[end], elements[end + 2]
        differ = np.zeros(len(one), bool)
        for column in np.ascontiguousarray(rows.T):
            a, b = column.take(one), column.take(other)
            differ |= a != b if near == 0 else np.abs(a.astype(np.float64) - b) > near
        if layer.kind == "normal":
            where = np.flatnonzero(differ)
            differ[where] = _apart(rows.take(one.take(where), axis=0), rows.take(other.take(where), axis=0))
        found |= differ
    return found


def _folds(layer: Layer, elements: Ints, pairs: Ints) -> Bools:
    """Tell the edges where a UV map turns back on itself, as where both sides of a thing share their texture."""
    a, b, c = (layer.rows.take(row, axis=0).astype(np.float64) for row in elements)
    one, other = b - a, c - a
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    size = (one * one).sum(axis=1) + (other * other).sum(axis=1)
    turn = np.sign(area) * (np.abs(area) > _THIN * size)
    return turn.take(pairs[0] % len(turn)) * turn.take(pairs[2] % len(turn)) < 0


def _apart(one: np.ndarray, other: np.ndarray) -> Bools:
    a, b = one.astype(np.float64), other.astype(np.float64)
    lengths = np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1))
    return (a * b).sum(axis=1) < _NEAR_NORMAL * lengths
