# SPDX-License-Identifier: GPL-3.0-or-later
"""Carries all attributes of a mesh to its levels, and parts their vertices again where the input's were parted."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .adjacency import components
from .attributes import AttributeSet, Layer, blended
from .carried import Carried
from .carry import Ground, Places, find_places, numbered, positions
from .edge_data import carried_edges
from .fitted import Sampled, fitted, joints, on_same_side
from .lines import Lines
from .mesh import Bools, Floats, Ints
from .prepare import Prepared
from .refit import Refitted
from .reinsertion import with_parts
from .symmetry import Mirror, completed
from .unflip import areas_of, mapped_by_source, turned_back

# faces up to which what levels are laid on is kept for the next one
_MOST_KEPT = 500_000


class _Level(NamedTuple):
    """A level on its way: where its wedges and corners lie on the original."""

    places: Places
    corner: Ints
    vertex: Ints
    target: Ints
    wedge_of: Ints
    unmoved: Bools
    face_map: Ints
    there: Floats
    sampled: Sampled | None


class Carrier:
    """What a mesh carries, ready to be put on any of its levels.

    Parameters
    ----------
    mesh : Prepared
    original : tuple of ndarray
        The input: vertices (n, 3) float64 and faces (m, 3) int64.
    attributes : AttributeSet
    lines : Lines
    locked : ndarray, (engine's vertices,) bool
    mirror : Mirror, optional
        Where the mesh is one half of the input.

    Attributes
    ----------
    messages : tuple of str
        What was mended.
    """

    def __init__(self, mesh: Prepared, original: tuple[Floats, Ints], attributes: AttributeSet, lines: Lines,
                 locked: Bools, mirror: Mirror | None = None) -> None:
        self._mesh, self._attributes, self._lines, self._mirror = mesh, attributes, lines, mirror
        self._original = original
        self._own = attributes if mirror is None else mirror.of_half(attributes)
        faces = original[1] if mirror is None else original[1][mirror.half]
        self._points = np.ascontiguousarray(original[0].take(mesh.source, axis=0).T)
        self._ground: Ground | None = None
        self._vertex = faces.ravel().take(lines.corner)  # the input's vertex at each corner
        self._locked, self._lined = locked, locked.copy()  # the second: or on lines
        self._lined[lines.edges] = True
        self.messages = (*attributes.messages, *lines.messages)

    def held(self, survivor: Ints, count: int) -> Bools:
        """Tell the level's vertices, (count,) bool, that are locked: a refit must leave them."""
        held = np.zeros(count + 1, bool)
        held[survivor.compress(self._locked)] = True  # those that are gone write beyond the end
        return held[:-1]

    @property
    def line_edges(self) -> Ints:
        """The engine's edges that are lines, (2, s) int64."""
        return self._lines.edges

    @property
    def flips(self) -> bool:
        """Whether edges may flip: a UV map's triangles could turn over."""
        return not any(layer.kind == "uv" for layer in self._attributes.layers)

    @property
    def reinserts(self) -> bool:
        """Whether vertices may come back: faces split where edges may flip, but not in one half of a mesh alone."""
        return self.flips and self._mirror is None

    def sheets(self, face_map: Ints) -> Ints | None:
        """Return the connected part of the input that each face is in, None where the weld joined none."""
        return None if self._mesh.sheet is None else self._mesh.sheet.take(self._vertex[0].take(face_map))

    def bound(self, survivor: Ints, count: int) -> Bools:
        """Tell the level's vertices, (count,) bool, between which edges must not flip: they carry a line or a value."""
        bound = np.zeros(count + 1, bool)
        bound[survivor.compress(self.marked)] = True  # those that are gone write beyond the end
        return bound[:-1]

    @cached_property
    def marked(self) -> Bools:
        """The engine's vertices, (n,) bool, on lines, locked, or at an edge that carries a value."""
        marked = self._lined.copy()
        for layer in self._own.on("edge"):
            ends = self._mesh.vertex.take(self._own.edges[(layer.rows != 0).any(axis=1)])
            marked[ends[ends >= 0]] = True
        return marked

    def carry(self, placed: Floats, corners: Ints, face_map: Ints, survivor: Ints,
              fit: Refitted) -> Carried:
        """Put everything on a level.

        Parameters
        ----------
        placed : ndarray, (k, 3) float64
            Positions of the level's vertices.
        corners : ndarray, (f, 3) int64
            Wound as in the input.
        face_map : ndarray, (f,) int64
            The engine's face of each.
        survivor : ndarray, (engine's vertices,) int64
            The level's vertex that each had become before any came back, -1 if it is gone.
        fit : Refitted
            What has become of the level's faces, and where samples of the original lie on them.
        """
        survivor = np.where(survivor < 0, len(placed), survivor)
        if self._mirror is not None:
            placed = self._flattened(placed, survivor, self._mirror)
        there = np.concatenate((placed.T, np.zeros((3, 1))), axis=1)
        ground = self._ground or Ground(self._lines, self._points)
        if self._lines.faces.shape[1] <= _MOST_KEPT:
            self._ground = ground
        places = find_places(ground, survivor, there)
        # the engine may wind a face the other way than the input does
        rows = np.tile(np.arange(3)[:, None], len(face_map))
        if self._mesh.turned is not None:
            rows[1:, self._mesh.turned[face_map]] = [[2], [1]]
        slot = (rows * self._lines.faces.shape[1] + face_map).T.ravel()
        slot = slot.take(fit.corner.ravel())
        face_map = with_parts(face_map, fit.corner)
        target, back = places.target.ravel().take(slot), fit.back
        if len(back):
            fresh = np.flatnonzero(corners.ravel() >= len(placed) - len(back))
            number = corners.ravel().take(fresh) - (len(placed) - len(back))
            own = self._corner_of.take(back)
            slot[fresh], target[fresh] = own.take(number), len(places.vertex) + number
            places = self._with(places, own, len(placed))
        number, wedge_of, vertex_map = self._part(places, slot, target)
        vertex = self._lines.faces.ravel().take(slot)
        unmoved = (self._points == there.take(survivor, axis=1)).all(axis=0).take(vertex)
        sampled = None if fit.met is None else on_same_side(Sampled(fit.source, fit.met), self._lines, places,
                                                            target.reshape(-1, 3))
        at = _Level(places, self._lines.corner.ravel().take(slot), vertex, target, wedge_of, unmoved, face_map, there,
                    sampled)
        carried = self._values(self._own, at)
        points, parted = placed.take(places.vertex.take(wedge_of), axis=0), number.reshape(-1, 3)
        edges, on_edges = carried_edges(self._own, self._points, self._mesh.vertex, self._lines, survivor,
                                        places.vertex.take(wedge_of), parted, placed)
        level = Carried(points, parted, vertex_map, self._mesh.face[face_map], {**carried, **on_edges}, edges)
        if self._mirror is None:
            return level
        images = self._values(self._mirror.of_half(self._attributes, mirrored=True), at)
        return completed(level, images, self._mirror, self._original, self._attributes)

    def _with(self, places: Places, own: Ints, count: int) -> Places:
        """Add wedges of vertices that came back, the last of `count`, at these corners of their own."""
        corner, face = np.divmod(own, self._lines.faces.shape[1])
        weights = (np.arange(3)[:, None] == corner).astype(np.float64)
        number = places.number.copy()
        number[self._lines.wedge.ravel().take(own)] = len(places.vertex) + np.arange(len(own))
        return Places(number, places.target, np.concatenate((places.face, face)),
                      np.concatenate((places.weights, weights), axis=1),
                      np.concatenate((places.vertex, np.arange(count - len(own), count))))

    @cached_property
    def _corner_of(self) -> Ints:
        """A corner of each of the engine's vertices, as a slot."""
        corners = self._lines.faces.ravel()
        corner_of = np.zeros(self._points.shape[1], np.int64)
        corner_of[corners] = np.arange(len(corners))
        return corner_of

    def _values(self, attributes: AttributeSet, at: _Level) -> dict[str, NDArray]:
        """Return the attributes of vertices, corners and faces on a level."""
        carried = {}
        for layer in attributes.layers:
            if layer.domain == "corner":
                values = self._at_corners(layer, at)
                if layer.kind == "uv":
                    values = self._turned_back(layer, values, at)
            elif layer.domain == "vertex":
                values = self._at_wedges(layer, at, self._vertex).take(at.wedge_of, axis=0)
            elif layer.domain == "face":
                values = layer.rows.take(self._mesh.face.take(at.face_map), axis=0)
            else:
                continue
            carried[layer.name] = layer.shaped(values)
        return carried

    def _flattened(self, placed: Floats, survivor: Ints, mirror: Mirror) -> Floats:
        """Put what has become of vertices in the plane of symmetry into it."""
        inside = np.flatnonzero(mirror.flat & (self._mesh.vertex >= 0))
        rows = np.concatenate((placed, np.zeros((1, 3))))
        rows[survivor.take(self._mesh.vertex.take(inside)), mirror.axis] = 0
        return rows[:-1]

    def _at_corners(self, layer: Layer, at: _Level) -> NDArray:
        values = self._at_wedges(layer, at, self._lines.corner).take(at.target, axis=0)
        values[at.unmoved] = layer.rows.take(at.corner[at.unmoved], axis=0)
        return values

    def _turned_back(self, layer: Layer, values: NDArray, at: _Level) -> NDArray:
        """Turn back UV triangles that lie the other way round than their source."""
        places, there, faces = at.places, at.there, at.target.reshape(-1, 3)
        source = layer.rows.take(at.corner, axis=0).astype(np.float64).reshape(-1, 3, 2)
        turns = areas_of(source)
        if not (areas_of(values.reshape(-1, 3, 2)) * turns < 0).any():
            return values
        uv = np.zeros((len(places.vertex), 2))
        uv[faces.ravel()] = values
        lined = np.zeros(there.shape[1], bool)
        lined[places.vertex.take(places.target.ravel().compress(self._lined.take(self._lines.faces.ravel())))] = True
        mended, still = turned_back(uv, faces, turns, ~lined.take(places.vertex))
        moved = (mended != uv).any(axis=1).take(faces.ravel())
        values[moved] = mended.take(faces.ravel()[moved], axis=0)
        if still.any():
            corners = there.take(places.vertex.take(faces[still]), axis=1).transpose(1, 2, 0)
            before = self._points.take(at.vertex.reshape(-1, 3)[still], axis=1)
            values.reshape(-1, 3, 2)[still] = mapped_by_source(corners, before.transpose(1, 2, 0), source[still])
            over = still & (areas_of(values.reshape(-1, 3, 2)) * turns <= 0)
            values.reshape(-1, 3, 2)[over] = source[over]  # turned over in space too
        return values

    def _at_wedges(self, layer: Layer, at: _Level, elements: Ints) -> NDArray:
        """Return what the wedges of a level have: what is at their places, then fitted to the samples."""
        places = at.places
        rows = blended(layer, elements.take(places.face, axis=1), places.weights)
        if at.sampled is None or not layer.fits or layer.name in self._lines.scattered:
            return rows
        joint = joints(layer, self._lines, elements, places)
        points = np.zeros((3, int(joint.max(initial=-1)) + 1))
        points[:, joint] = at.there.take(places.vertex, axis=1)
        free = np.ones(len(joint), bool)
        free[at.target[at.unmoved]] = False
        return fitted(layer, rows, elements, joint, free, at.sampled, points, at.target.reshape(-1, 3))

    def _part(self, places: Places, slot: Ints, target: Ints) -> tuple[Ints, Ints, Ints]:
        """Part the level's vertices as the input's are: at lines where its faces have different vertices.

        Returns the vertex of each of the level's corners, a wedge of each vertex, and the input's vertex map.
        """
        wedge, links = self._joined
        ones, others = places.number.take(links)
        apart = np.flatnonzero(ones != others)
        group = components(len(places.vertex), ones.take(apart), others.take(apart))
        group = _in_order(group, places.vertex)
        keys, wanted = group.take(target), np.where(wedge < 0, -1, group.take(places.number.take(wedge, mode="clip")))
        bound = int(group.max(initial=-1)) + 1
        if self._mesh.sheet is not None:
            count = int(self._mesh.sheet.max(initial=0)) + 1
            keys = keys * count + self._mesh.sheet.take(self._vertex.ravel().take(slot))
            wanted = np.where(wedge < 0, -1, wanted * count + self._mesh.sheet)
            bound *= count
        keys, number = numbered(keys, bound)
        wedge_of = np.zeros(len(keys), np.int64)
        wedge_of[number[::-1]] = target[::-1]  # of several the first holds
        return number, wedge_of, positions(keys, wanted, bound)

    @cached_property
    def _joined(self) -> tuple[Ints, Ints]:
        """A wedge at each of the input's vertices, -1 where it has no face, and (2, k) wedges that share a vertex."""
        vertex, wedges = self._vertex.ravel(), self._lines.wedge.ravel()
        wedge = np.full(len(self._mesh.vertex), -1)
        wedge[vertex] = wedges  # of several the last holds
        others = wedge.take(vertex)
        apart = np.flatnonzero(wedges != others)
        return wedge, np.stack((wedges.take(apart), others.take(apart)))


def _in_order(group: Ints, vertex: Ints) -> Ints:
    """Renumber groups of wedges by their vertices."""
    vertex_of = np.zeros(int(group.max(initial=-1)) + 1, np.int64)
    vertex_of[group] = vertex
    rank = np.empty(len(vertex_of), np.int64)
    rank[np.argsort(vertex_of, kind="stable")] = np.arange(len(vertex_of))
    return rank.take(group)
