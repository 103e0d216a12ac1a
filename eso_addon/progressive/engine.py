# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the engine with survivors that stay, and the vertices that the engine must not touch."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from ..core.blocks import Blocks
from ..core.collapse import Rules, collapse_steps
from ..core.mesh import Bools, Floats, Ints, MeshError
from ..core.options import Options
from ..core.prepare import Prepared, prepare
from ..core.record import CollapseRecord
from ..core.weigh import initial_quadrics
from .fans import fans_at


def prepared(points: Floats, faces: Ints) -> Prepared | None:
    """Make the mesh ready without joining vertices; None where no face can take part."""
    try:
        return prepare(points, faces, join=False)
    except MeshError:
        return None


def tangled(faces: Ints, count: int) -> Bools:
    """Find the vertices whose faces are anything but one fan: (count,) bool.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    count : int
    """
    fans = fans_at(faces, np.ones(count, bool))
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


def run_engine(mesh: Prepared, locked: Bools, options: Options, target: int) -> Generator[int, None, CollapseRecord]:
    """Collapse down to a number of faces; yields faces left.

    Parameters
    ----------
    mesh : Prepared
    locked : ndarray, (n,) bool
        The engine's vertices that must not go.
    options : Options
    target : int
    """
    blocks = Blocks(options.threads)
    try:
        quadrics = initial_quadrics(mesh, options, blocks)
        rules = Rules(True, options.memory, options.flip, options.guard, options.share, options.spread,
                      options.method == "cf")
        return (yield from collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened,
                                          locked if locked.any() else None, target, rules, blocks))
    finally:
        blocks.close()


def endpoint_options(preset_options: dict[str, Any]) -> Options:
    """Return the engine's options for patches: survivors stay where they are."""
    unknown = sorted(set(preset_options) - set(Options.__dataclass_fields__))
    if unknown:
        raise MeshError(f"unknown option {unknown[0]!r}: choose from {', '.join(Options.__dataclass_fields__)}")
    return Options(**{**preset_options, "placement": "endpoint", "refit": False, "weld": False})
