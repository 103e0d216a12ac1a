# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of levels of several meshes: equal to what `lod_chain` makes, complete, and honest about what is missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from eso_addon.core.chains import Chain, Goals, chains_steps
from eso_addon.core.mesh import MeshError
from eso_addon.core.options import Options
from eso_addon.core.screen import Screen
from eso_addon.core.simplify import lod_chain

from . import shapes

BALL = shapes.ball(3)
TORUS = shapes.noisy(shapes.torus(16, 24), np.random.default_rng(0), 0.01)


def chains(meshes: Sequence[shapes.Mesh], kind: str, values: Sequence[float], *, copies: Sequence[int] | None = None,
           **options: object) -> list[Chain]:
    own = [Options(**options)] * len(meshes)  # type: ignore[arg-type]
    progress, result = shapes.drained(chains_steps(meshes, Goals(kind, values), own, copies))
    assert all(0 <= part <= 1 for part in progress)
    assert (np.diff(progress) > -1e-9).all()
    return result


@pytest.mark.parametrize(("kind", "name", "values"), [
    ("ratio", "ratios", [0.5, 0.2, 0.1]), ("count", "faces_targets", [300, 100, 20]),
    ("error", "max_errors", [0.05])])
def test_each_mesh_gets_what_it_gets_alone(kind: str, name: str, values: list[float]) -> None:
    for chain, mesh in zip(chains([BALL, TORUS], kind, values), (BALL, TORUS), strict=True):
        alone = lod_chain(*mesh, **{name: values})  # type: ignore[arg-type]
        for level, wanted in zip(chain.levels, alone, strict=True):
            assert_array_equal(level.result.vertices, wanted.vertices)
            assert_array_equal(level.result.faces, wanted.faces)


def test_a_level_begins_where_its_error_is_a_pixel() -> None:
    (chain,) = chains([BALL], "ratio", [0.5, 0.1])
    for level in chain.levels:
        assert level.distance == pytest.approx(Screen().distance_for_error(level.result.error))


def test_levels_by_size_are_within_a_pixel_at_that_size() -> None:
    screen, sizes = Screen(), [400, 50]
    (chain,) = chains([TORUS], "screen", sizes)
    extent = float(np.ptp(TORUS[0], axis=0).max())
    assert len(chain.levels) == 2
    for level, size in zip(chain.levels, sizes, strict=True):
        assert level.distance == pytest.approx(screen.distance_for_size(extent, size))
        assert level.result.error * screen.focal / level.distance <= 1


def test_a_budget_is_kept_and_every_level_has_every_mesh() -> None:
    meshes = [BALL, TORUS, shapes.tetrahedron()]
    made = chains(meshes, "budget", [900, 300, 100])
    for level, total in enumerate((900, 300, 100)):
        assert total - 2 < sum(len(chain.levels[level].result.faces) for chain in made) <= total
    assert [len(level.result.faces) for level in made[2].levels] == [4, 4, 4]


def test_copies_count_in_a_budget() -> None:
    made = chains([BALL, TORUS], "budget", [800], copies=[3, 1])
    counts = [len(chain.levels[0].result.faces) for chain in made]
    assert 800 - 6 < 3 * counts[0] + counts[1] <= 800


def test_a_level_out_of_reach_says_what_would_help_and_is_no_copy() -> None:
    mesh = shapes.joined(shapes.ball(2), (shapes.ball(1)[0] * 0.1, shapes.ball(1)[1]))
    (chain,) = chains([mesh], "count", [100, 6, 5])
    assert [len(level.result.faces) for level in chain.levels] == [100, 8]
    text = " ".join(chain.messages)
    assert "stopped at 8 of 6" in text
    assert "level 2 is left out" in text
    size = float(text.split("pruning at ")[1].split()[0])
    (pruned,) = chains([mesh], "count", [6], prune=size)
    assert pruned.levels[0].result.reached
    assert len(pruned.levels[0].result.faces) <= 6


def test_where_pruning_does_not_help_none_is_advised() -> None:
    (chain,) = chains([shapes.tetrahedron()], "count", [2])
    assert "stopped at 4 of 2" in " ".join(chain.messages)
    assert "pruning" not in " ".join(chain.messages)


def test_a_budget_out_of_reach_says_so() -> None:
    made = chains([BALL, TORUS], "budget", [5])
    assert "in all" in " ".join(made[0].messages)


@pytest.mark.parametrize(("kind", "values"), [
    ("ratio", [0]), ("ratio", [1.5]), ("ratio", [float("nan")]), ("count", [0]), ("count", [2.5]), ("error", [-1]),
    ("screen", [0]), ("screen", [float("inf")]), ("budget", [0]), ("magic", [1]), ("ratio", [])])
def test_bad_goals(kind: str, values: list[float]) -> None:
    with pytest.raises(MeshError):
        chains([BALL], kind, values)


def test_locks_that_hold_triangles_are_named() -> None:
    mesh = shapes.sheet(8, 8)
    (chain,) = chains([mesh], "count", [2], boundary_lines="locked")
    assert not chain.levels[0].result.reached
    assert "release boundary_lines" in " ".join(chain.messages)
    (chain,) = chains([mesh], "count", [2], locked=np.ones(len(mesh[0]), bool))
    assert "release the vertices that are locked" in " ".join(chain.messages)
    (chain,) = chains([mesh], "count", [2])
    assert "release" not in " ".join(chain.messages)
