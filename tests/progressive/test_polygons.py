# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as triangles with marked diagonals: there and back, however they are cut."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.progressive.polygons import CORNER, DIAGONAL, find_polygons, mark_polygons

Polygons = list[list[int]]


def random_polygons(rng: np.random.Generator) -> Polygons:
    """Make quads of a grid, an n-gon, and now and then a polygon twice or a triangle along a diagonal."""
    side = int(rng.integers(2, 6))
    quads = [y * side + x for y in range(side - 1) for x in range(side - 1)]
    polygons = [[a, a + 1, a + side + 1, a + side] for a in quads]
    polygons.append(list(range(side * side, side * side + int(rng.integers(3, 9)))))
    if rng.random() < 0.3:
        polygons.append(polygons[0])
    if rng.random() < 0.3:
        polygons.append([polygons[0][0], polygons[0][2], side * side])
    return [np.roll(polygons[k], rng.integers(9)).tolist() for k in rng.permutation(len(polygons))]


def cut(polygons: Polygons, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Cut ears off at random; return faces, corners, polygon of each, and starts."""
    starts = np.concatenate(([0], np.cumsum([len(polygon) for polygon in polygons])))
    faces, corners, owner = [], [], []
    for number, polygon in enumerate(polygons):
        left = list(range(len(polygon)))
        while len(left) >= 3:
            at = int(rng.integers(len(left)))
            ear = left if len(left) == 3 else [left[at - 1], left[at], left[(at + 1) % len(left)]]
            faces.append([polygon[k] for k in ear])
            corners.append([starts[number] + k for k in ear])
            owner.append(number)
            left.pop(at)
    return np.array(faces), np.array(corners), np.array(owner), starts


def found(faces: np.ndarray, marks: dict) -> Polygons:
    slots, starts = find_polygons(faces, marks)
    return [faces.ravel()[slots[a:b]].tolist() for a, b in zip(starts, starts[1:], strict=False)]


def rounds(polygons: Polygons) -> list:
    return sorted(min(tuple(p[k:] + p[:k]) for k in range(len(p))) for p in polygons)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32))
def test_there_and_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    polygons = random_polygons(rng)
    arrays = cut(polygons, rng)
    assert found(arrays[0], mark_polygons(*arrays, keep_order=True)) == polygons
    marks = mark_polygons(*arrays, keep_order=False)
    order = rng.permutation(len(arrays[0]))
    shuffled = {domain: {name: values[order] for name, values in named.items()} for domain, named in marks.items()}
    assert rounds(found(arrays[0][order], shuffled)) == rounds(polygons)


def test_triangles_need_no_marks() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    assert mark_polygons(faces, np.arange(6).reshape(2, 3), np.arange(2), np.array([0, 3, 6]), keep_order=True) == {}
    assert found(faces, {}) == faces.tolist()


def test_polygons_twice_are_numbered() -> None:
    polygons = [[0, 1, 2, 3]] * 2
    corners = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    arrays = corners % 4, corners, np.array([0, 0, 1, 1]), np.array([0, 4, 8])
    marks = mark_polygons(*arrays, keep_order=False)
    assert CORNER in marks["side"]
    assert rounds(found(arrays[0], marks)) == rounds(polygons)


@pytest.mark.parametrize("marked", [0, 1])
def test_what_is_not_one_round_falls_apart(marked: int) -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    diagonal = np.zeros((2, 3), bool)
    diagonal[marked] = True
    assert found(faces, {"side": {DIAGONAL: diagonal}}) == faces.tolist()
