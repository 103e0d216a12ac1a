# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a level fitted to what the original has at samples, so that what is seen between vertices is right too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .adjacency import components
from .attributes import Layer
from .carry import Places
from .guard import halve
from .least_squares import Equations, Meeting
from .lines import Lines
from .mesh import Bools, Floats, Ints
from .unflip import areas_of

# what moves less than this, beside the layer's largest value, is rounding: equal values stay equal to the last bit
_ROUNDING = 1e-7
# a UV triangle keeps at least this part of its area
_LEFT = 0.2


class Sampled(NamedTuple):
    """Samples of the original on a level.

    Attributes
    ----------
    source : ndarray, (s,) int64
        The engine's faces whose centres they are.
    met : Meeting
        Where they are on the level.
    """

    source: Ints
    met: Meeting


def on_same_side(sampled: Sampled, lines: Lines, places: Places, faces: Ints) -> Sampled:
    """Return the samples that lie on the level's faces which their own faces have become a corner of.

    Others are on the far side of a line, or on another part that lies near.
    """
    own = places.number.take(lines.wedge.take(sampled.source, axis=1))
    there = faces.T.take(sampled.met.face, axis=1)
    same = np.flatnonzero((own[:, None] == there).any(axis=(0, 1)))
    face, shares, weights = sampled.met
    return Sampled(sampled.source.take(same), Meeting(face.take(same), shares.take(same, axis=1), weights.take(same)))


def joints(layer: Layer, lines: Lines, elements: Ints, places: Places) -> Ints:
    """Return what has one value, (t,) int64 for each of a level's wedges: lines of other layers do not part it."""
    across = lines.unbroken(layer, elements)
    ones, others = places.target.ravel().take(across)
    apart = np.flatnonzero(ones != others)
    return components(len(places.vertex), ones.take(apart), others.take(apart))


def fitted(layer: Layer, rows: Floats, elements: Ints, joint: Ints, free: Bools, sampled: Sampled, points: Floats,
           faces: Ints) -> Floats:
    """Return a layer's rows fitted to the samples.

    Parameters
    ----------
    layer : Layer
    rows : ndarray, (t, width)
        What the wedges of the level have.
    elements : ndarray, (3, m) int64
        The layer's at the corners of the engine's faces.
    joint, free : ndarray, (t,)
        The same number for wedges that have one value; those whose value may change.
    sampled : Sampled
    points : ndarray, (3, k) float64
        Of the joints, at their numbers.
    faces : ndarray, (f, 3) int64
        Wedges of the level's faces.
    """
    held = np.zeros(points.shape[1], bool)
    held[joint[~free]] = True
    start = np.zeros((rows.shape[1], len(held)))
    start[:, joint[::-1]] = rows[::-1].T  # of several the first holds
    equations = Equations(points.T, joint.take(faces), sampled.met)
    corners = elements.take(sampled.source, axis=1)
    wanted = sum(layer.rows.take(corner, axis=0).T.astype(np.float64) for corner in corners) / 3
    values = equations.best_values(start, _unit(wanted) if layer.kind == "normal" else wanted, ~held)
    if layer.kind == "normal":
        values = _unit(values)
    else:  # colours stay colours, and a map that fills its image does not reach over to the other side of it
        values = values.clip(layer.rows.min(axis=0)[:, None], layer.rows.max(axis=0)[:, None])
    step = values - start
    step[:, held | (np.abs(step).max(axis=0) <= _ROUNDING * np.abs(start).max(initial=0))] = 0
    if layer.kind == "uv":
        step = without_turns(start, step, joint.take(faces))
    moved = np.flatnonzero(step.any(axis=0).take(joint))
    rows = rows.copy()
    new = (start + step).T.take(joint.take(moved), axis=0)
    rows[moved] = np.rint(new) if rows.dtype.kind in "iub" else new
    return rows


def _unit(columns: Floats) -> Floats:
    return columns / np.maximum(np.sqrt((columns * columns).sum(axis=0)), 1e-30)


def without_turns(uv: Floats, step: Floats, faces: Ints) -> Floats:
    """Return the step, halved and at last left out around triangles that would turn over or lose most of their area."""
    before = areas_of(uv.T.take(faces, axis=0))
    share, judged = np.ones(uv.shape[1]), np.arange(len(faces))
    while len(judged):
        corners, was = faces.take(judged, axis=0), before.take(judged)
        after = areas_of((uv + share * step).T.take(corners, axis=0))
        bad = (after * np.sign(was) < _LEFT * np.abs(was)) & (share.take(corners).max(axis=1) > 0)
        judged = halve(share, faces, judged[bad])
    return share * step
