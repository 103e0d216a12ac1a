# SPDX-License-Identifier: GPL-3.0-or-later
"""Any level of a record equals its collapses carried out one at a time."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from eso_addon.core.record import CollapseRecord

from .shapes import Floats, Ints

QUICK = settings(max_examples=80, deadline=None)


def random_record(seed: int) -> tuple[CollapseRecord, Floats, Ints]:
    """Return a record of any collapses whatever, and its mesh."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 30))
    faces = np.stack([rng.permutation(count)[:3] for _ in range(rng.integers(1, 60))])
    alive, removed, kept = list(range(count)), [], []
    for _ in range(rng.integers(0, count - 1)):
        gone = alive.pop(rng.integers(len(alive)))
        removed.append(gone)
        kept.append(alive[rng.integers(len(alive))])
    left, corners = [], faces
    for gone, stays in zip(removed, kept, strict=True):
        corners = np.where(corners == gone, stays, corners)
        left.append(int((np.diff(np.sort(corners, axis=1), axis=1) > 0).all(axis=1).sum()))
    number = len(removed)
    record = CollapseRecord(
        np.array(removed, np.int64), np.array(kept, np.int64), rng.normal(size=(number, 3)),
        np.array(left, np.int64), np.zeros(number, np.float32), np.zeros(1, np.int64), len(faces),
        np.zeros(number, bool))
    return record, rng.normal(size=(count, 3)), faces


@QUICK
@given(st.integers(0, 2**32))
def test_a_level_is_its_collapses_one_by_one(seed: int) -> None:
    record, vertices, faces = random_record(seed)
    points, corners, merged = vertices.copy(), faces.copy(), np.arange(len(vertices))
    for length in range(len(record) + 1):
        if length:
            gone, stays = record.removed[length - 1], record.kept[length - 1]
            corners[corners == gone] = stays
            merged[merged == gone] = stays
            points[stays] = record.position[length - 1]
        there = np.flatnonzero((np.diff(np.sort(corners, axis=1), axis=1) > 0).all(axis=1))
        found, found_corners, face_map, survivor = record.level(vertices, faces, length)
        assert_array_equal(survivor, merged)
        assert_array_equal(record.survivors(len(vertices), length), merged)
        assert_array_equal(face_map, there)
        assert_array_equal(found_corners, corners[there])
        alive = merged == np.arange(len(merged))
        assert_array_equal(found[alive], points[alive])


@QUICK
@given(st.integers(0, 2**32))
def test_length_is_the_least_that_reaches_the_count(seed: int) -> None:
    record, _, faces = random_record(seed)
    left = [len(faces), *record.faces_left.tolist()]
    for count in range(len(faces) + 3):
        reached = [length for length, faces_left in enumerate(left) if faces_left <= count]
        assert record.length_for(count) == (reached[0] if reached else len(record))


def test_the_input_is_not_touched() -> None:
    record, vertices, faces = random_record(5)
    before = vertices.copy(), faces.copy()
    record.level(vertices, faces, len(record))
    assert_array_equal(vertices, before[0])
    assert_array_equal(faces, before[1])
