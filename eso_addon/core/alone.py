# SPDX-License-Identifier: GPL-3.0-or-later
"""Collapses that fail even where nothing else is collapsed: found at once, so that no batch is made of them."""

from collections.abc import Callable

import numpy as np

from .adjacency import stars
from .mesh import Bools, Ints
from .quadrics import Components, cross

_Turned = Callable[[Components, Components], Bools]


def fails_alone(rows: np.ndarray, faces: Ints, boundary: Bools, gone: Ints, kept: Ints, turned: _Turned) -> Bools:
    """Tell the half-edge collapses that turn a face over or break the link condition, each in the mesh as it is.

    Parameters
    ----------
    rows : ndarray, (n, 4) float32
    faces : ndarray, (3, m) int64
    boundary : ndarray, (n,) bool
    gone, kept : ndarray, (c,) int64
        Of each collapse the vertex that goes, and the neighbour that it goes into.
    turned : callable
        Tells by a face's normals before and after whether it turns too far.

    Returns
    -------
    ndarray, (c,) bool
        All of these fail in the engine too; few that it refuses at a boundary are not among them.
    """
    used, number = np.unique(np.concatenate((gone, kept)), return_inverse=True)
    near = np.zeros(len(rows), bool)
    near[used] = True
    face = np.flatnonzero(near.take(faces).any(axis=0))
    local = np.full(len(rows), len(used))
    local[used] = np.arange(len(used))
    around = stars(local.take(faces.take(face, axis=1)).T, len(used) + 1)
    going, staying = np.split(number, 2)
    own, near_gone = _expanded(around, going)
    ring_own, near_kept = _expanded(around, staying)
    corner, ring_corner = faces.take(face.take(near_gone), axis=1), faces.take(face.take(near_kept), axis=1)
    onto = kept.take(own)
    falls = (corner == onto).any(axis=0)
    left = np.flatnonzero(~falls)
    moved = corner.take(left, axis=1)
    moved = np.where(moved == gone.take(own.take(left)), onto.take(left), moved)
    fails = np.zeros(len(gone), bool)
    fails[own.take(left[turned(_normals(rows, corner.take(left, axis=1)), _normals(rows, moved))])] = True
    falling = np.bincount(own[falls], minlength=len(gone))
    fewest = np.where(boundary.take(gone) | boundary.take(kept), 1, 3)
    fails |= np.bincount(own, minlength=len(gone)) + np.bincount(ring_own, minlength=len(gone)) - 2 * falling < fewest
    shared = np.intersect1d(_ring(own, corner), _ring(ring_own, ring_corner), assume_unique=True) >> 32
    # both ends are in both rings
    return fails | (np.bincount(shared, minlength=len(gone)) > falling + 2)


def _expanded(around: tuple[Ints, Ints], vertices: Ints) -> tuple[Ints, Ints]:
    """Return the faces around each vertex: whose they are, as a place in `vertices`, and which."""
    offsets, faces = around
    first = offsets.take(vertices)
    counts = offsets.take(vertices + 1) - first
    own = np.repeat(np.arange(len(vertices)), counts)
    return own, faces.take(np.arange(len(own)) + np.repeat(first - np.cumsum(counts) + counts, counts))


def _ring(own: Ints, corner: Ints) -> Ints:
    return np.unique((own << 32) | corner)


def _normals(rows: np.ndarray, corner: Ints) -> Components:
    base = rows.take(corner[0], axis=0)
    return cross((rows.take(corner[1], axis=0) - base).T, (rows.take(corner[2], axis=0) - base).T)
