# SPDX-License-Identifier: GPL-3.0-or-later
"""What a valid mesh is, the weld, and the order in space."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from numpy.testing import assert_array_equal

from eso_addon.core.mesh import MeshError, check_mesh, morton_order, weld

from .shapes import Floats

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int32, np.uint8])
def test_any_numbers_become_contiguous_float64_and_int64(kind: type) -> None:
    vertices, faces = check_mesh(np.asfortranarray(TRIANGLE, kind), np.array([[0, 1, 2]], np.uint16)[:, ::-1])
    assert vertices.dtype == np.float64
    assert faces.dtype == np.int64
    assert vertices.flags.c_contiguous
    assert faces.flags.c_contiguous
    assert_array_equal(vertices, TRIANGLE)
    assert_array_equal(faces, [[2, 1, 0]])


@pytest.mark.parametrize("empty", [[], np.zeros((0, 3)), ()])
def test_empty_is_valid_here(empty: object) -> None:
    vertices, faces = check_mesh(empty, empty)
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)


@pytest.mark.parametrize(("vertices", "faces", "words"), [
    ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "vertices must be"),
    ([0.0, 1.0, 2.0], [[0, 1, 2]], "vertices must be"),
    ([["a", "b", "c"]], [[0, 0, 0]], "vertices must be"),
    ([[1j, 0, 0]], [[0, 0, 0]], "vertices must be"),
    ([[True, False, True]], [[0, 0, 0]], "vertices must be"),
    ([[0, 0, 0], [1, 0]], [[0, 1, 2]], "differ in length"),
    (None, [[0, 1, 2]], "vertices must be"),
    (TRIANGLE, [[0, 1, 2, 0]], "triangulate"),
    (TRIANGLE, [[0, 1, 2], [0, 1]], "differ in length"),
    (TRIANGLE, [0, 1, 2], "triangulate"),
    (TRIANGLE, [[0.0, 1.0, 2.0]], "integers"),
    (TRIANGLE, [[0, 1, 3]], "face 0"),
    (TRIANGLE, [[0, 1, 2], [0, -1, 2]], "face 1"),
    (TRIANGLE, [[0, 1, 2**40]], "face 0"),
    ([], [[0, 1, 2]], "0 vertices"),
    ([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]], "vertex 1"),
    ([[0, 0, 0], [1, 0, 0], [0, -np.inf, 0]], [[0, 1, 2]], "vertex 2"),
])
def test_what_is_wrong_is_said_in_one_line(vertices: object, faces: object, words: str) -> None:
    with pytest.raises(MeshError, match=words) as caught:
        check_mesh(vertices, faces)
    assert "\n" not in str(caught.value)


def test_loose_vertices_may_hold_anything() -> None:
    vertices, _ = check_mesh([*TRIANGLE, [np.nan, np.inf, 0]], [[0, 1, 2]])
    assert len(vertices) == 4


COORDINATES = st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.1, 5e-324, 1e300, np.nextafter(1.0, 2.0)])


@given(npst.arrays(np.float64, st.tuples(st.integers(0, 60), st.just(3)), elements=COORDINATES))
@example(np.zeros((3, 3)) * [[1.0], [-1.0], [1.0]])
def test_weld_equals_a_dictionary(vertices: Floats) -> None:
    first: dict[tuple[float, ...], int] = {}
    expected = [first.setdefault(tuple(p), i) for i, p in enumerate((vertices + 0.0).tolist())]
    assert_array_equal(weld(vertices), expected)


def test_weld_of_many_vertices() -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(20_000, 3))
    which = rng.integers(0, len(places), 50_000)
    _, first, number = np.unique(which, return_index=True, return_inverse=True)
    assert_array_equal(weld(places[which]), first[number])


@given(st.integers(0, 2**32), st.integers(0, 300), st.sampled_from([1.0, 1e12, 1e-12, 1e-300]))
def test_morton_order_holds_each_vertex_once(seed: int, count: int, scale: float) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3)) * scale + scale
    assert_array_equal(np.sort(morton_order(points)), np.arange(count))


def test_morton_order_keeps_neighbours_together() -> None:
    points = np.random.default_rng(0).random((8000, 3))
    jumps = np.linalg.norm(np.diff(points[morton_order(points)], axis=0), axis=1)
    assert jumps.mean() < 3 * 8000 ** (-1 / 3)  # at random they would be 0.66
    assert_array_equal(morton_order(np.ones((7, 3))), np.arange(7))
