# SPDX-License-Identifier: GPL-3.0-or-later
"""Open places and winding, against lists of directed sides."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from eso_addon.core.adjacency import vertex_components
from eso_addon.core.manifold import boundary_sides, open_vertices, orient, winding_conflicts

from . import shapes
from .shapes import Ints

QUICK = settings(max_examples=60, deadline=None)


def proper(faces: Ints) -> Ints:
    """Return the faces with three different corners: the others are dropped before."""
    return faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]


def sides(faces: Ints) -> list[tuple[int, int]]:
    return [(f[i], f[(i + 1) % 3]) for i in range(3) for f in faces.tolist()]


@QUICK
@given(st.integers(0, 2**32))
def test_open_where_sides_do_not_pair(seed: int) -> None:
    vertices, faces = shapes.anything(seed)
    faces = proper(faces)
    ways = Counter(sides(faces))
    expected = np.zeros(len(vertices), bool)
    for (a, b), times in ways.items():
        if ways[b, a] != times:
            expected[[a, b]] = True
    assert_array_equal(open_vertices(faces.T, len(vertices)), expected)


@QUICK
@given(st.integers(0, 2**32))
def test_boundary_sides_have_no_other_face(seed: int) -> None:
    vertices, faces = shapes.anything(seed)
    faces = proper(faces)
    uses = Counter(frozenset(side) for side in sides(faces))
    expected = [slot for slot, side in enumerate(sides(faces)) if uses[frozenset(side)] == 1]
    assert_array_equal(boundary_sides(faces.T, open_vertices(faces.T, len(vertices))), expected)


@QUICK
@given(st.integers(0, 2**32))
def test_conflict_where_two_faces_run_the_same_way(seed: int) -> None:
    vertices, faces = shapes.anything(seed)
    faces = proper(faces)
    ways = Counter(sides(faces))
    expected = any(times == 2 and (b, a) not in ways for (a, b), times in ways.items())
    assert winding_conflicts(faces.T, open_vertices(faces.T, len(vertices))) == expected


@QUICK
@given(st.integers(0, 2**32), st.floats(0, 0.45))
def test_faces_wound_against_the_others_are_found(seed: int, share: float) -> None:
    vertices, faces = shapes.manifold(seed)
    rng = np.random.default_rng(seed)
    turned = rng.random(len(faces)) < share
    found = orient(np.where(turned[:, None], faces[:, ::-1], faces).T, len(vertices))
    part = vertex_components(faces, len(vertices))[faces[:, 0]]
    for number in np.unique(part):
        here, there = turned[part == number], found[part == number]
        assert there.sum() * 2 <= len(there)
        assert np.array_equal(here, there) or np.array_equal(~here, there)


def test_one_side_has_no_winding() -> None:
    vertices, faces = shapes.mobius(12)
    over = orient(faces.T, len(vertices))
    mended = np.where(over[:, None], faces[:, ::-1], faces)
    assert winding_conflicts(mended.T, open_vertices(mended.T, len(vertices)))


@pytest.mark.parametrize("count", [0, 5])
def test_no_faces_no_sides(count: int) -> None:
    none = np.zeros((3, 0), np.int64)
    opened = open_vertices(none, count)
    assert not opened.any()
    assert len(opened) == count
    assert len(boundary_sides(none, opened)) == 0
    assert len(orient(none, count)) == 0
    assert not winding_conflicts(none, opened)
