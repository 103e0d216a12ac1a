# SPDX-License-Identifier: GPL-3.0-or-later
"""What guides a run besides the shape: lines of the attributes, vertices that are locked, and what each counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .attributes import Layer, check_attributes
from .carrier import Carrier
from .lines import MATERIAL, SEAM, SHARP, Lines, find_lines
from .mesh import Bools, Floats, Ints, MeshError
from .options import Options
from .prepare import Prepared
from .symmetry import Mirror


@dataclass(frozen=True, eq=False)
class Guidance:
    """What the engine is told about one mesh; None where there is nothing to tell.

    Attributes
    ----------
    lines : Lines, optional
    locked : ndarray, (n,) bool, optional
    importance : ndarray, (n,) float64, optional
    carrier : Carrier, optional
    layers : tuple of (Layer, ndarray)
        What may enter the cost, with the elements at the corners of the engine's faces, (3, m) int64.
    """

    lines: Lines | None
    locked: Bools | None
    importance: Floats | None
    carrier: Carrier | None
    layers: tuple[tuple[Layer, Ints], ...] = ()

    @property
    def edges(self) -> Ints | None:
        """The edges of the lines, (2, s) int64."""
        return None if self.lines is None else self.lines.edges


def guidance_of(mesh: Prepared, original: tuple[Floats, Ints], options: Options,
                mirror: Mirror | None = None) -> Guidance:
    """Find what guides the run on a mesh.

    Parameters
    ----------
    mesh : Prepared
    original : tuple of ndarray
        Vertices (n, 3) float64 and faces (m, 3) int64 as they were given.
    options : Options
    mirror : Mirror, optional
        Where `mesh` is one half of it.

    Raises
    ------
    MeshError
        An attribute, the locked vertices or their importance do not fit the mesh.
    """
    vertices, faces = original
    locked = np.zeros(mesh.points.shape[1], bool)
    if options.boundary_lines == "locked":
        locked[mesh.boundary_edges] = True
    if options.locked is not None:
        chosen = _per_vertex("locked", options.locked, len(vertices)) != 0
        locked[mesh.vertex[chosen & (mesh.vertex >= 0)]] = True
    if mirror is not None:
        locked[mesh.vertex[mirror.locked & (mesh.vertex >= 0)]] = True
    importance = _importance(mesh, options, len(vertices))
    if not options.attributes and not locked.any() and mirror is None:
        return Guidance(None, None, importance, None)
    attributes = check_attributes(options.attributes or {}, len(vertices), len(faces), options.edges)
    modes = {SEAM: options.seam_lines, MATERIAL: options.material_lines, SHARP: options.sharp_lines}
    own, input_faces = (attributes, faces) if mirror is None else (mirror.of_half(attributes), faces[mirror.half])
    lines = find_lines(mesh, input_faces, own, sum(bit for bit, mode in modes.items() if mode == "ignored"))
    for bit, mode in modes.items():
        if mode == "locked":
            locked[lines.along(bit)] = True
    carrier = Carrier(mesh, original, attributes, lines, locked, mirror)
    elements = {"corner": lines.corner, "vertex": input_faces.ravel().take(lines.corner)}
    layers = tuple((layer, elements[layer.domain]) for layer in own.layers
                   if layer.domain in elements and layer.name not in lines.scattered)
    return Guidance(lines, locked if locked.any() else None, importance, carrier, layers)


def _importance(mesh: Prepared, options: Options, count: int) -> Floats | None:
    if options.importance is None:
        return None
    given = _per_vertex("importance", options.importance, count).astype(np.float64)
    if not (np.isfinite(given).all() and (given >= 0).all()):
        raise MeshError("importance must be 0 or more at every vertex")
    # of vertices at one place the most important counts; nothing at all could not be solved
    most = np.zeros(mesh.points.shape[1])
    used = np.flatnonzero(mesh.vertex >= 0)
    np.maximum.at(most, mesh.vertex[used], given[used])
    return np.maximum(most, 1e-6)


def _per_vertex(name: str, values: object, count: int) -> np.ndarray:
    array = np.asarray(values)
    if array.shape != (count,) or array.dtype.kind not in "fiub":
        raise MeshError(f"{name} must be an array of {count} numbers, one for each vertex, not {array.shape} "
                        f"{array.dtype}")
    return array
