# SPDX-License-Identifier: GPL-3.0-or-later
"""The preset `paper` on the paper's own cow: the ESO column of its Table 7, as an exact run gives it."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from eso_addon.core.deviation import measure
from eso_addon.core.simplify import lod_chain, simplify

from .shapes import Mesh, read_obj

# triangles: distance from the simplified mesh to the original relative to the diagonal, and how near to it
TABLE = {2321: (0.00442, 1.15), 1741: (0.00506, 1.15), 1160: (0.00659, 1.15), 580: (0.01234, 1.15), 290: (0.02241, 1.7)}


@pytest.fixture(scope="module")
def cow(sample_meshes: Path) -> Mesh:
    return read_obj(sample_meshes / "cow.obj")


def test_distances_of_the_table(cow: Mesh) -> None:
    for level, (count, (expected, factor)) in zip(
        lod_chain(*cow, faces_targets=list(TABLE), preset="paper"), TABLE.items(), strict=True
    ):
        assert len(level.faces) in (count, count - 1)
        deviation = measure(*cow, level.vertices, level.faces, samples=40_000)
        found = deviation.backward.maximum / deviation.diagonal
        assert expected / factor <= found <= expected * factor, f"{found:.5f} at {count}"


def test_nothing_but_the_equations(cow: Mesh) -> None:
    """Unit planes, the weights as they are, no boundary planes, no guard, no refit."""
    spelt = {"method": "eso", "rings": 3, "weight_power": 1.0, "weight_floor": 0.0, "area_weighted": False,
             "boundary_weight": 0.0, "guard": False, "refit": False, "placement": "optimal"}
    paper, same = (simplify(*cow, faces_target=580, preset="paper", **options) for options in ({}, spelt))
    assert_array_equal(paper.vertices, same.vertices)
    assert_array_equal(paper.faces, same.faces)


def test_the_default_loses_less(cow: Mesh) -> None:
    """Sampled both ways, which the paper did not, the defaults are better."""
    counts = [1160, 580, 290]
    means = [[measure(*cow, level.vertices, level.faces, samples=10_000).symmetric.mean
              for level in lod_chain(*cow, faces_targets=counts, preset=preset)] for preset in ("default", "paper")]
    assert np.prod(means[0]) < 0.8 * np.prod(means[1])


@pytest.mark.parametrize("apart", [[], [[1.0, 0, 0]]])
@pytest.mark.parametrize("goal", [{"faces_target": 1}, {"max_error": 5.0}])
def test_something_is_always_left(apart: list, goal: dict) -> None:
    """Nothing guards the topology there: all triangles of a closed part could go."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    sides = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    vertices = np.concatenate([corners, *(corners + offset for offset in apart)])
    faces = np.concatenate([sides + 4 * part for part in range(1 + len(apart))])
    result = simplify(vertices, faces, preset="paper", **goal)
    assert len(result.faces) == 2
    assert 0 < result.error < 1
    assert result.reached == ("max_error" in goal)
