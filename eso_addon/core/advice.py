# SPDX-License-Identifier: GPL-3.0-or-later
"""What would help a level that stopped short of its target."""

from __future__ import annotations

import numpy as np

from .adjacency import part_diagonals, vertex_components
from .levels import SimplifyResult
from .mesh import weld
from .options import Options


def prune_for(result: SimplifyResult, target: int) -> tuple[float, int] | None:
    """Find the size of parts to prune so that a level gets down to its target.

    Parameters
    ----------
    result : SimplifyResult
        A level with more triangles than asked for.
    target : int
        Triangles that were asked for.

    Returns
    -------
    (float, int) or None
        The value for `prune`, in the mesh's units, and how many parts it drops; None where even dropping all parts
        but the largest would not do.
    """
    vertices, faces = result.original
    part = vertex_components(weld(vertices).take(faces), len(vertices)).take(weld(vertices).take(faces[:, 0]))
    _, part = np.unique(part, return_inverse=True)
    sizes = part_diagonals(vertices, faces, part)
    order = np.argsort(sizes, kind="stable")
    kept = np.bincount(part.take(result.face_map), minlength=len(sizes)).take(order)
    left = len(result.faces) - np.cumsum(kept)  # without the parts up to this one
    sizes = sizes.take(order)
    # a size tells only parts apart that differ by more than rounding
    possible = np.flatnonzero((left[:-1] <= target) & (sizes[1:] > sizes[:-1] * (1 + 1e-6)))
    if not len(possible):
        return None
    last = int(possible[0])
    return _short_number_between(float(sizes[last]), float(sizes[last + 1])), last + 1


def _short_number_between(low: float, high: float) -> float:
    """Return the number with the fewest digits above one number and at most another."""
    for digits in range(1, 17):
        short = float(f"{low * (1 - 10.0**-digits) + high * 10.0**-digits:.{digits}g}")
        for number in (float(f"{(low + high) / 2:.{digits}g}"), short, float(f"{high:.{digits}g}")):
            if low < number <= high:
                return number
    return high


def locks_of(options: Options) -> tuple[str, ...]:
    """Name the options that keep edges or vertices of a mesh from going."""
    lines = [name for name in ("seam_lines", "material_lines", "sharp_lines", "boundary_lines")
             if getattr(options, name) == "locked"]
    held = options.locked is not None and bool(np.any(options.locked))
    return (*lines, *(["the vertices that are locked"] if held else []))
