# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from eso_addon.core.steps import run_to_end
from eso_addon.jobs import second_opinion

FACES = np.array([[0, 1, 2], [1, 3, 2]])
FLAT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)


def test_pymeshlab_says_how_far_two_parallel_squares_are_apart() -> None:
    if not second_opinion.is_there():
        pytest.skip("pymeshlab is not installed")
    figures = run_to_end(second_opinion.second_opinion_steps(FLAT, FACES, FLAT + [0, 0, 0.25], FACES, 1000))
    assert figures == pytest.approx({"maximum": 0.25, "mean": 0.25})


def test_a_failure_is_no_opinion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_opinion, "_SCRIPT", "raise SystemExit(3)")
    assert run_to_end(second_opinion.second_opinion_steps(FLAT, FACES, FLAT, FACES, 10)) == {}


def test_it_can_be_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_opinion, "_SCRIPT", "import time; time.sleep(60)")
    steps = second_opinion.second_opinion_steps(FLAT, FACES, FLAT, FACES, 10)
    next(steps)
    steps.close()
