# SPDX-License-Identifier: GPL-3.0-or-later
"""Collapses that fail alone: those that the slow mesh refuses, one by one."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.adjacency import boundary_vertices, unique_edges
from eso_addon.core.alone import fails_alone
from eso_addon.core.quadrics import Components

from . import shapes
from .oracle import _Mesh as SlowMesh
from .shapes import Bools


def turned(old: Components, new: Components) -> Bools:
    turn = old[0] * new[0] + old[1] * new[1] + old[2] * new[2]
    was, becomes = (side[0] * side[0] + side[1] * side[1] + side[2] * side[2] for side in (old, new))
    return (turn <= 0.2 * np.sqrt(was * becomes)) & (was > 0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_what_fails_alone_is_what_the_slow_mesh_refuses(seed: int) -> None:
    vertices, faces = shapes.manifold(seed)
    boundary = boundary_vertices(faces, len(vertices))
    edges, _ = unique_edges(faces, len(vertices))
    gone, kept = np.concatenate((edges, edges[:, ::-1])).T
    rows = np.zeros((len(vertices), 4))
    rows[:, :3] = vertices
    fails = fails_alone(rows, np.ascontiguousarray(faces.T), boundary, gone, kept, turned)
    slow = SlowMesh(vertices, faces)
    for v, onto, found in zip(gone.tolist(), kept.tolist(), fails.tolist(), strict=True):
        point = slow.points[onto]
        if found:
            assert slow.flips(onto, v, point, 0.2 + 1e-6) or not slow.keeps_topology(onto, v)
        else:
            assert not slow.flips(onto, v, point, 0.2 - 1e-6)
            assert boundary[v] or boundary[onto] or slow.keeps_topology(onto, v)


def test_no_collapse_fails_where_there_is_none() -> None:
    vertices, faces = shapes.ball(1)
    none = np.zeros(0, np.int64)
    rows = np.zeros((len(vertices), 4))
    assert len(fails_alone(rows, faces.T, np.zeros(len(vertices), bool), none, none, turned)) == 0
