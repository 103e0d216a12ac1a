# SPDX-License-Identifier: GPL-3.0-or-later
"""A level with all that it carries, as the input has it."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from .mesh import Floats, Ints


class Carried(NamedTuple):
    """A level with all that it carries: vertices as the input parts them.

    Attributes
    ----------
    points : ndarray, (k, 3) float64
    corners : ndarray, (m, 3) int64
    vertex_map : ndarray, (n,) int64
    face_map : ndarray, (m,) int64
    attributes : dict of str to ndarray
    edges : ndarray, (e, 2) int64
        What edge attributes belong to.
    """

    points: Floats
    corners: Ints
    vertex_map: Ints
    face_map: Ints
    attributes: dict[str, NDArray]
    edges: Ints
