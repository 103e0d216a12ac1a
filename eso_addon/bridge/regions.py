# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a mesh that are treated apart: those that a vertex group paints, and those that are not selected."""

from typing import Any

import numpy as np

from ..core.mesh import MeshError
from .read_mesh import MeshArrays


def group_options(source: MeshArrays, name: str, *, use: str, factor: float, invert: bool) -> dict[str, Any]:
    """Give the engine's options for a vertex group.

    Parameters
    ----------
    source : MeshArrays
        Read with what it carries.
    name : str
    use : str
        "favour": errors count `1 + factor * weight` times; "protect": from a weight of one half on vertices are locked.
    factor : float
    invert : bool
        Use one less the weight.

    Raises
    ------
    MeshError
        There is no such group.
    """
    if source.groups is None or name not in source.groups.names:
        raise MeshError(f"there is no vertex group '{name}': choose another, or none")
    weights = source.groups.weights[:, source.groups.names.index(name)].astype(np.float64)
    if invert:
        weights = 1 - weights
    return {"locked": weights >= 0.5} if use == "protect" else {"importance": 1 + factor * weights}


def outside_selection(source: MeshArrays) -> np.ndarray | None:
    """Tell the vertices, (n,) bool, of faces that are not selected; None if all faces are, or none is."""
    if source.selected is None:
        return None
    outside = np.zeros(len(source.vertices), bool)
    outside[source.triangles[~source.selected]] = True
    return outside


def target_for_selection(source: MeshArrays, target: dict[str, Any]) -> dict[str, Any]:
    """Turn a ratio of the selected triangles into a count of all."""
    if source.selected is None or "ratio" not in target:
        return target
    if not 0 < target["ratio"] <= 1:
        return target  # the engine says what is wrong with it
    chosen = int(source.selected.sum())
    return {"faces_target": len(source.selected) - chosen + max(round(chosen * target["ratio"]), 1)}
