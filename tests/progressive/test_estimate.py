# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of levels: they never grow, and are about what is measured."""

import numpy as np
from hypothesis import HealthCheck, given, settings

from eso_addon.core.deviation import measure
from eso_addon.progressive.progressive import from_bytes, progressive

from .meshes import Arrays, grid, meshes


@settings(max_examples=5, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(mesh=meshes())
def test_errors_fall_to_nothing(mesh: Arrays) -> None:
    whole = progressive(**mesh, base_faces=4)
    errors = whole.batch_errors
    assert len(errors) == whole.batches + 1
    assert np.isfinite(errors).all()
    assert (np.diff(errors) <= 0).all()
    assert errors[-1] == 0
    assert np.allclose(from_bytes(whole.to_bytes()).batch_errors, errors, rtol=1e-6)


def test_errors_are_what_is_measured() -> None:
    points, faces = grid(40, 40, np.random.default_rng(0), closed=True)
    whole = progressive(points, faces)
    for error in (0.2, 0.4, 0.8):
        level = whole.at(error=error)
        assert len(level.faces) < len(faces)
        found = measure(points.astype(float), faces, level.vertices.astype(float), level.faces, samples=5000)
        assert found.symmetric.maximum < 2 * error
    assert len(whole.at(error=0).faces) == len(faces)
    assert len(whole.at(error=1e9).faces) == whole.base_faces
