# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes and errors in pixels against distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from eso_addon.core.mesh import MeshError
from eso_addon.core.screen import Screen, extent_of

LENGTHS = st.floats(1e-6, 1e6)


def test_blenders_default_camera() -> None:
    # A wall as wide as the distance times sensor by lens fills the picture.
    screen = Screen(resolution=1920, lens=50, sensor=36)
    assert screen.distance_for_size(36 / 50 * 10, 1920) == pytest.approx(10)


@given(extent=LENGTHS, size=st.floats(1, 1e5), pixels=st.floats(0.1, 10))
def test_an_error_is_so_many_pixels_where_the_object_is_so_large(extent: float, size: float, pixels: float) -> None:
    screen = Screen(pixels=pixels)
    distance = screen.distance_for_size(extent, size)
    error = screen.error_at(extent, size)
    assert screen.distance_for_error(error) == pytest.approx(distance)
    assert error * screen.focal / distance == pytest.approx(pixels)


@given(radius=LENGTHS, near=LENGTHS, factor=st.floats(1, 100))
def test_coverage_falls_with_distance(radius: float, near: float, factor: float) -> None:
    screen = Screen()
    assert 0 <= screen.coverage(radius, near * factor) <= screen.coverage(radius, near) <= 1
    assert screen.coverage(radius, 0) == 1


@pytest.mark.parametrize("bad", [{"resolution": 0}, {"lens": 0}, {"pixels": -1}, {"resolution": 2.5},
                                 {"lens": float("nan")}])
def test_bad_pictures(bad: dict) -> None:
    with pytest.raises(MeshError):
        Screen(**bad)


def test_extent_is_of_the_vertices_in_use() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 3, 0], [99, 99, 99]], float)
    assert extent_of(vertices, np.array([[0, 1, 2]])) == 3
    assert extent_of(vertices, np.zeros((0, 3), np.int64)) == 0
