# SPDX-License-Identifier: GPL-3.0-or-later
"""The finest mesh of some patches in its original winding, and its hash."""

import hashlib

import numpy as np

from ..core.mesh import Ints
from .patches import Patches
from .source import DOMAINS


def digest(patches: Patches) -> str:
    """Return the hash of the finest mesh in the stream's order, each face from its lowest vertex: SHA-256, hex."""
    positions, corners, wedges = finest(patches)
    a, b, c = corners
    first = np.where((a <= b) & (a <= c), 0, np.where(b <= c, 1, 2))
    rows = (first + np.arange(3)[:, None]) % 3
    sha = hashlib.sha256()
    sha.update(np.ascontiguousarray(positions, "<f4").tobytes())
    turn = np.take_along_axis
    sha.update(turn(corners, rows, 0).T.astype("<u4").tobytes())
    sha.update(patches.edges.astype("<u4").tobytes())
    for domain in DOMAINS:
        for array in patches.attributes.get(domain, {}).values():
            if domain == "corner":
                array = array[turn(wedges, rows, 0).T]
            elif domain == "side":
                array = array[np.arange(len(array))[:, None], turn(side_rows(patches), rows, 0).T]
            sha.update(np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()


def side_rows(patches: Patches) -> Ints:
    """Return the row of each output side in the stored face: turned faces run the other way."""
    extra = patches.extra.shape[1]
    rows = np.repeat(np.arange(3)[:, None], extra + patches.faces.shape[1], axis=1)
    turned = np.flatnonzero(patches.turned) + extra
    rows[1:, turned] = rows[:0:-1, turned]
    return rows


def finest(patches: Patches) -> tuple[np.ndarray, Ints, Ints]:
    """Return positions by vertex, (3, m) corners as vertices, and as wedges, in their original winding."""
    place = np.concatenate((patches.extra, patches.faces), axis=1)
    wedges = patches.wedge_starts.take(place) + np.concatenate((patches.extra_wedge, patches.corner_wedge), axis=1)
    if patches.turned.any():
        wedges = np.take_along_axis(wedges, side_rows(patches), 0)
    corners = patches.wedge_vertex.take(wedges)
    place_of_wedge = np.repeat(np.arange(len(patches.places)), np.diff(patches.wedge_starts))
    fresh = np.flatnonzero(np.diff(patches.wedge_vertex, prepend=-1))
    return patches.places.take(place_of_wedge.take(fresh), axis=0), corners, wedges
