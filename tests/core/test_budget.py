# SPDX-License-Identifier: GPL-3.0-or-later
"""One number of triangles for many meshes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.budget import share_budget
from eso_addon.core.mesh import MeshError, check_mesh
from eso_addon.core.options import Options
from eso_addon.core.recording import Recording, recording_steps

from . import shapes


def recorded(mesh: shapes.Mesh, **options: object) -> Recording:
    return shapes.drained(recording_steps(check_mesh(*mesh), Options(**options), 1))[1]  # type: ignore[arg-type]


@lru_cache
def props() -> tuple[Recording, ...]:
    """Record forty meshes of many sizes and shapes."""
    rng = np.random.default_rng(5)
    found = []
    for number in range(40):
        kinds = shapes.ball(2), shapes.torus(6 + number % 7, 12), shapes.sheet(9, 9 + number % 5, rng, 0.2)
        vertices, faces = shapes.noisy(kinds[number % 3], rng, 0.01)
        found.append(recorded((vertices * rng.uniform(0.05, 20), faces)))
    return tuple(found)


def floor_of(recordings: tuple[Recording, ...]) -> int:
    return sum(int(r.record.faces_left[-1]) for r in recordings)


@given(share=st.floats(0, 1))
@settings(max_examples=100)
def test_forty_props_are_within_a_thousandth_and_never_above(share: float) -> None:
    whole = sum(r.record.faces_before for r in props())
    total = int(floor_of(props()) + share * (whole - floor_of(props())))
    (counts,) = share_budget(props(), [total])
    assert total - 2 < counts.sum() <= total
    assert counts.sum() >= total * 0.999 or total - counts.sum() == 1
    for recording, count in zip(props(), counts, strict=True):
        assert count == recording.record.faces_before or count in recording.record.faces_left


def test_more_triangles_for_all_never_mean_fewer_for_one() -> None:
    whole = sum(r.record.faces_before for r in props())
    counts = share_budget(props(), [whole, whole // 2, whole // 4, whole // 8])
    # what is left over after the last collapse of all may move one collapse from mesh to mesh
    assert (np.diff(counts, axis=0) <= 2).all()
    assert counts[0].tolist() == [r.record.faces_before for r in props()]


def test_triangles_go_where_they_matter() -> None:
    flat, bumpy = shapes.sheet(12, 12), shapes.noisy(shapes.sheet(12, 12), np.random.default_rng(0), 0.05)
    big = (bumpy[0] * 10, bumpy[1])
    flat_count, small_count, big_count = share_budget([recorded(m) for m in (flat, bumpy, big)], [300])[0]
    assert flat_count < small_count < big_count


@given(copies=st.lists(st.integers(1, 6), min_size=40, max_size=40), share=st.floats(0.05, 1))
@settings(max_examples=50)
def test_copies_count_each_time(copies: list[int], share: float) -> None:
    times = np.array(copies)
    least = int(np.array([r.record.faces_left[-1] for r in props()]) @ times)
    whole = int(np.array([r.record.faces_before for r in props()]) @ times)
    total = int(least + share * (whole - least))
    (counts,) = share_budget(props(), [total], copies)
    assert counts @ times <= total
    assert counts @ times >= total - 2 * times.max()


def test_what_the_engine_cannot_reach_is_as_low_as_it_goes() -> None:
    (counts,) = share_budget(props(), [1])
    assert counts.sum() == floor_of(props())


@pytest.mark.parametrize("total", [0, -5, 2.5, float("nan")])
def test_bad_totals(total: float) -> None:
    with pytest.raises(MeshError, match="faces_target"):
        share_budget(props()[:1], [total])  # type: ignore[list-item]


def test_no_mesh() -> None:
    with pytest.raises(MeshError, match="no mesh"):
        share_budget([], [10])
