# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the engine with survivors that stay, and the vertices that the engine must not touch."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.attributes import Attribute
from ..core.blocks import Blocks
from ..core.collapse import collapse_steps
from ..core.feature_collapse import guide_for
from ..core.features import sharp_edges
from ..core.guidance import Guidance, guidance_of
from ..core.mesh import Bools, Floats, Ints, MeshError
from ..core.options import Options
from ..core.prepare import Prepared, prepare
from ..core.record import CollapseRecord
from ..core.weigh import initial_quadrics
from .fans import fans_at

# batches are filled up once more than simplification asks: half as many are quicker to make, to write and to read
_PASSES = 2
# two closed fans have at least so many faces
_TWO_FANS = 4


def prepared(points: Floats, faces: Ints) -> Prepared | None:
    """Make the mesh ready without joining vertices; None where no face can take part."""
    try:
        return prepare(points, faces, join=False)
    except MeshError:
        return None


def tangled(faces: Ints, opened: Bools) -> Bools:
    """Find the vertices whose faces are anything but one fan: (n,) bool.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    opened : ndarray, (n,) bool
        Vertices at a boundary or at an edge that is not manifold. Others with few faces cannot have several fans.
    """
    count = len(opened)
    fans = fans_at(faces, opened | (np.bincount(faces.ravel(), minlength=count) >= _TWO_FANS))
    corners = len(fans.vertex)
    start = np.full(count, corners)
    open_start = np.flatnonzero(fans.predecessor < 0)
    np.minimum.at(start, fans.vertex, np.arange(corners))
    start[fans.vertex[open_start]] = open_start
    bad = np.zeros(count, bool)
    bad[fans.repeated] = True
    bad |= np.bincount(fans.vertex[open_start], minlength=count) > 1
    degree = np.bincount(fans.vertex, minlength=count)
    # walk around: as many steps as there are corners must come back or to the end, and not sooner
    at = np.flatnonzero((degree > 0) & ~bad)
    begin = start.take(at)
    current, steps, left = begin.copy(), np.ones(len(at), np.int64), np.arange(len(at))
    limit = 64
    while len(left) and limit:
        onward = fans.successor.take(current.take(left))
        going = (onward >= 0) & (onward != begin.take(left))
        left = left[going]
        current[left] = onward[going]
        steps[left] += 1
        limit -= 1
    bad[at[steps != degree.take(at)]] = True  # also hubs of more than 64 faces: they only never go
    return bad


def run_engine(mesh: Prepared, locked: Bools, lines: Ints, options: Options,
               target: int) -> Generator[int, None, CollapseRecord]:
    """Collapse down to a number of faces; yields faces left.

    Parameters
    ----------
    mesh : Prepared
    locked : ndarray, (n,) bool
        The engine's vertices that must not go.
    lines : ndarray, (e, 2) int64
        Edges where attributes jump, in the numbers of the input: see `lines_of`.
    options : Options
    target : int
    """
    blocks = Blocks(options.threads, mesh.faces.shape[1])
    try:
        told = Guidance(None, None, None, None)
        if len(lines):
            marks = {"line": Attribute(np.ones(len(lines), bool), "edge", "seam")}
            # no face of the input is looked at: marks are on edges alone
            none = np.zeros((len(mesh.vertex), 3)), np.zeros((int(mesh.face.max(initial=-1)) + 1, 3), np.int64)
            told = guidance_of(mesh, none, replace(options, attributes=marks, edges=lines))
        guide = guide_for(mesh, options, told.edges) if options.method == "feature" else None
        quadrics = initial_quadrics(mesh, options, told)
        rules = replace(options.rules, passes=_PASSES)
        return (yield from collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened,
                                          locked if locked.any() else None, target, rules, blocks, guide))
    finally:
        blocks.close()


def lines_of(points: Floats, faces: Ints, wedges: Ints, material: Ints, marked: Bools) -> Ints:
    """Find where attributes jump: (e, 2) vertices; nothing where they jump at more than half of the edges.

    Parameters
    ----------
    points : ndarray, (n, 3) float64
    faces, wedges : ndarray, (3, m) int64
        Corners, and the kind of attributes that each has at its vertex.
    material : ndarray, (m,) int64
    marked : ndarray, (3, m) bool
        Sides that are lines whatever is beside them.
    """
    corner_values = [wedges.T] if wedges.any() else []
    face_values = [material] if material.any() else []
    rows = np.nonzero(marked.T)
    ends = np.stack((faces.T[rows], np.roll(faces, -1, axis=0).T[rows]), axis=1)
    if not (corner_values or face_values or len(ends)):
        return np.zeros((0, 2), np.int64)
    lines = sharp_edges(points, faces.T, face_values=face_values, corner_values=corner_values, marked=ends)
    if corner_values and 2 * len(lines) > faces.shape[1] * 3 // 2:
        lines = sharp_edges(points, faces.T, face_values=face_values, marked=ends)
    return lines


def endpoint_options(preset_options: dict[str, Any]) -> Options:
    """Return the engine's options for patches: survivors stay where they are."""
    unknown = sorted(set(preset_options) - set(Options.__dataclass_fields__))
    if unknown:
        raise MeshError(f"unknown option {unknown[0]!r}: choose from {', '.join(Options.__dataclass_fields__)}")
    # the plain quadrics give the better levels where survivors stay: docs/decisions/stream.md
    return Options(**{"method": "qem", **preset_options, "placement": "endpoint", "refit": False, "weld": False})
