# SPDX-License-Identifier: GPL-3.0-or-later
"""One number of triangles for many meshes: all their collapses compete in one order, the cheapest go first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .mesh import Ints, MeshError
from .options import number
from .recording import Recording


def share_budget(recordings: Sequence[Recording], totals: Sequence[int],
                 copies: Sequence[int] | None = None) -> Ints:
    """Share numbers of triangles among meshes.

    Parameters
    ----------
    recordings : sequence of Recording
        One for each mesh, run as far as they can be needed.
    totals : sequence of int
        Triangles of all meshes together, for each level.
    copies : sequence of int, optional
        How many times each mesh is there; each time counts.

    Returns
    -------
    counts : ndarray, (levels, meshes) int64
        Triangles of each mesh. No level exceeds its total where the engine can help it; nor is it more than
        one collapse short of it.

    Raises
    ------
    MeshError
        No mesh, or a total that is no whole number above 0.

    Notes
    -----
    Costs are not monotone along a record, so a collapse counts with the largest cost up to it: then a prefix of the
    common order is a prefix of each record. Costs are integrals of squared distances over area: they grow with the
    fourth power of the mesh's size.
    """
    if not recordings:
        raise MeshError("there is no mesh to share triangles with: give one at least")
    wanted = [int(number("faces_target", total, 1, 2.0**53, whole=True)) for total in totals]
    times = np.ones(len(recordings), np.int64) if copies is None else np.asarray(copies, np.int64)
    ladders = [_ladder(recording) for recording in recordings]
    owner = np.repeat(np.arange(len(ladders)), [len(ladder) - 1 for ladder in ladders])
    cost = np.concatenate([_monotone_cost(recording) for recording in recordings])
    order = np.lexsort((owner, cost))  # stable: each mesh's collapses stay in their order
    owner = owner[order]
    steps = np.concatenate([-np.diff(ladder) for ladder in ladders])[order] * times[owner]
    left = np.array([ladder[0] for ladder in ladders]) @ times - np.cumsum(np.concatenate(([0], steps)))
    counts = []
    for total in wanted:
        cut = int(np.searchsorted(-left, -total))  # the first place with at most so many
        lengths = np.bincount(owner[:cut], minlength=len(ladders))
        counts.append(_give_back(ladders, lengths, times, total))
    return np.array(counts, np.int64)


def _ladder(recording: Recording) -> Ints:
    """Return the triangles before the first collapse and after each."""
    return np.concatenate(([recording.record.faces_before], recording.record.faces_left)).astype(np.int64)


def _monotone_cost(recording: Recording) -> np.ndarray:
    power = 0 if recording.options.method == "feature" else 4 if recording.options.area_weighted else 2
    cost = np.nan_to_num(recording.record.cost.astype(np.float64), nan=0.0)
    return np.maximum.accumulate(np.maximum(cost, 0) * recording.mesh.size**power)


def _give_back(ladders: list[Ints], lengths: Ints, times: Ints, total: int) -> Ints:
    """Return the counts at these lengths, less collapses that the total leaves room to undo."""
    counts = np.array([ladder[length] for ladder, length in zip(ladders, lengths, strict=True)], np.int64)
    room = total - int(counts @ times)
    for mesh in np.argsort(times)[::-1]:  # the coarse grains first
        ladder, length = ladders[mesh], int(lengths[mesh])
        fits = np.searchsorted(ladder[:length + 1][::-1], ladder[length] + room // times[mesh], side="right") - 1
        if room > 0 and fits > 0:
            counts[mesh] = ladder[length - fits]
            room -= int(counts[mesh] - ladder[length]) * int(times[mesh])
    return counts
