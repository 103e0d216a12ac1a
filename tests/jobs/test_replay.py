# SPDX-License-Identifier: GPL-3.0-or-later
"""A replay gives what a fresh run gives, to the last bit."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon import lod_chain
from eso_addon.core.levels import SimplifyResult
from eso_addon.core.steps import run_to_end
from eso_addon.jobs import replay


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    replay.forget()
    yield
    replay.forget()


def bumpy(size: int = 12, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Give a field of random heights."""
    rng = np.random.default_rng(seed)
    x, y = np.mgrid[:size, :size]
    vertices = np.stack([x, y, rng.normal(0, 1.0, x.shape)], axis=-1).reshape(-1, 3).astype(float)
    corner = (np.arange(size - 1)[:, None] * size + np.arange(size - 1)).ravel()
    lower = np.stack([corner, corner + size, corner + size + 1], axis=1)
    upper = np.stack([corner, corner + size + 1, corner + 1], axis=1)
    return vertices, np.concatenate([lower, upper])


def run(targets: dict[str, Any], *, seed: int = 0, **options: Any) -> tuple[list[SimplifyResult], bool]:  # noqa: ANN401
    return run_to_end(replay.replayed_steps(*bumpy(seed=seed), targets=targets, options=options))


def assert_same(ours: list[SimplifyResult], fresh: list[SimplifyResult]) -> None:
    for one, other in zip(ours, fresh, strict=True):
        for name in ("vertices", "faces", "vertex_map", "face_map"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert (one.reached, one.messages, one.error) == (other.reached, other.messages, other.error)


@settings(max_examples=25)
@given(st.lists(st.floats(0.01, 1.0), min_size=1, max_size=4), st.sampled_from(["eso", "qem", "cf", "feature"]))
def test_every_ratio_is_replayed_as_a_fresh_run_would_give_it(ratios: list[float], method: str) -> None:
    replay.forget()
    for number, ratio in enumerate(ratios):
        levels, replayed = run({"ratios": [ratio]}, method=method, refit=False)
        assert replayed == (number > 0)
        assert_same(levels, lod_chain(*bumpy(), [ratio], method=method, refit=False))


@pytest.mark.parametrize("targets", [{"faces_targets": [100, 30]}, {"max_errors": [0.2]}, {"ratios": [0.2]}])
def test_other_kinds_of_targets_and_refit_are_replayed_too(targets: dict[str, Any]) -> None:
    run({"ratios": [0.5]}, refit=False)
    levels, replayed = run(targets, refit=True, threads=1)
    assert replayed
    assert_same(levels, lod_chain(*bumpy(), **targets))


@pytest.mark.parametrize("other", [{"seed": 1}, {"method": "qem"}, {"rings": 2}, {"preset": "paper"}, {"prune": 0.1}])
def test_another_mesh_or_option_is_another_run(other: dict[str, Any]) -> None:
    run({"ratios": [0.5]}, refit=False)
    assert not run({"ratios": [0.5]}, **{"refit": False, **other})[1]
    assert not run({"ratios": [0.5]}, refit=False)[1]  # one run is kept, the last


def test_contents_are_told_apart() -> None:
    values = [
        1, 1.0, "1", None, True, [1], [1, 1], (1,), {"a": 1}, {"b": 1}, np.zeros(3), np.zeros((3, 1)), -np.zeros(3),
        np.zeros(3, np.float32), np.arange(12.0).reshape(3, 4), np.arange(12.0).reshape(3, 4).T, np.zeros((0, 3)),
        [[1], 2], [[1, 2]], np.array([np.nan, 1]), np.array([1, np.nan]), np.array(["a"], object),
        np.array(["b"], object),
    ]  # fmt: skip
    for number, value in enumerate(values):
        assert [replay.same(value, other) for other in deepcopy(values)] == [number == i for i in range(len(values))]
    assert replay.same(np.arange(6)[::2], np.array([0, 2, 4]))
