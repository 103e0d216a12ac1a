# SPDX-License-Identifier: GPL-3.0-or-later
"""How far levels are from the original: distances of a sample of the original's vertices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.closest import ClosestPoints
from ..core.mesh import Floats, Ints

if TYPE_CHECKING:
    from .patches import Patches

_SAMPLE = 256
# levels with faces in this ratio are measured; those between lie on the line between two, which is never less than the
# convex fall of errors
_STEP = 0.4
# of larger levels only faces near what the samples have become are looked at
_LARGE = 4096


def estimated_errors(patches: Patches, costs: Floats) -> Floats:
    """Return the deviation of the base and after each batch: (batches + 1,) float64, never growing, 0 at the end.

    The largest distance to the level's faces of some places that have gone: those whose collapse cost most, and some
    spread over all.

    Parameters
    ----------
    patches : Patches
    costs : ndarray, (p,) float
        Of the collapse of each place.
    """
    starts, widths = patches.place_starts, patches.face_starts + patches.extra.shape[1]
    points = np.where(np.isfinite(patches.places), patches.places, 0).astype(np.float64)
    errors = np.full(len(starts), -1.0)
    errors[-1] = 0
    faces, ancestor, measured = patches.faces, np.arange(len(points)), widths[-1]
    for level in range(len(starts) - 2, -1, -1):
        faces, ancestor = (_before(places, patches.parents, int(starts[level]))
                           for places in (faces[:, : patches.face_starts[level]], ancestor))
        coarse_enough = level == 0 or widths[level - 1] <= _STEP * measured
        if coarse_enough and widths[level]:
            sample = starts[level] + _sample(costs[starts[level] :])
            near = np.concatenate((_near(faces, ancestor[sample], len(points)), patches.extra), axis=1).T
            squared = ClosestPoints(points, near).query(points[sample])[2]
            errors[level] = np.sqrt(squared.max(initial=0.0))
            measured = widths[level]
    known = np.flatnonzero(errors >= 0)
    # with more faces no farther off
    return np.interp(widths, widths[known], np.maximum.accumulate(errors[known][::-1])[::-1])


def _sample(costs: Floats) -> Ints:
    half = _SAMPLE // 2
    spread = np.arange(0, len(costs), max(len(costs) // half, 1))
    dear = np.argpartition(costs, -half)[-half:] if len(costs) > half else np.zeros(0, np.int64)
    return np.union1d(spread, dear)


def _before(places: Ints, parents: Ints, count: int) -> Ints:
    """Return what places were before a batch: none of it splits twice, so one step back is enough."""
    return np.where(places >= count, parents.take(places), places)


def _near(faces: Ints, places: Ints, count: int) -> Ints:
    """Return the faces within two rings of some places; all of a small mesh."""
    if faces.shape[1] <= _LARGE:
        return faces
    near = np.zeros(count, bool)
    near[places] = True
    near[faces.compress(near.take(faces).any(axis=0), axis=1)] = True
    return faces.compress(near.take(faces).any(axis=0), axis=1)
