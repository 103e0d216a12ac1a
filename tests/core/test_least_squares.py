# SPDX-License-Identifier: GPL-3.0-or-later
"""The least squares of a refit."""

import numpy as np
import pytest

from eso_addon.core.least_squares import Equations, Meeting, Samples, best_step
from eso_addon.core.normals import face_normals

from . import shapes


def sampled(seed: int) -> tuple[np.ndarray, np.ndarray, Samples, Meeting]:
    """Return a ball, samples a little off its faces, and where they meet them."""
    rng = np.random.default_rng(seed)
    vertices, faces = shapes.ball(2)
    faces = np.asarray(faces, np.int64)
    face = np.sort(rng.integers(0, len(faces), 10 * len(faces)))
    places = rng.dirichlet((1, 1, 1), len(face)).T
    points = np.einsum("cs,scx->xs", places, vertices[faces[face]])
    normals = face_normals(vertices, faces)[face].T.copy()
    points = points + normals * rng.normal(0.02, 0.005, len(face))
    weights = rng.uniform(0.5, 1.5, len(face))
    none = np.zeros(0, np.int64)
    return vertices, faces, Samples(points, points.astype(np.float32), weights, normals, none, face), \
        Meeting(face, places, weights)


@pytest.mark.parametrize("across", [False, True])
def test_the_system_is_symmetric_and_positive(across: bool) -> None:
    vertices, faces, _, met = sampled(0)
    normals = face_normals(vertices, faces).T.copy() if across else None
    equations = Equations(vertices, faces, met, normals)
    one, other = np.random.default_rng(1).normal(size=(2, 3, len(vertices)))
    np.testing.assert_allclose((one * equations.times(other)).sum(), (other * equations.times(one)).sum(), rtol=1e-9)
    assert (one * equations.times(one)).sum() > 0
    for vertex in (0, 5, len(vertices) - 1):
        for axis in range(3):
            unit = np.zeros((3, len(vertices)))
            unit[axis, vertex] = 1
            diagonal = np.broadcast_to(equations.diagonal, (3, len(vertices)))
            np.testing.assert_allclose(equations.times(unit)[axis, vertex], diagonal[axis, vertex], rtol=1e-9)


def test_steps_along_a_face_are_held_by_a_part() -> None:
    vertices, faces, _, met = sampled(2)
    normals = face_normals(vertices, faces).T.copy()
    free, held = Equations(vertices, faces, met, normals), Equations(vertices, faces, met)
    outward = vertices.T / np.linalg.norm(vertices, axis=1)
    around = np.cross(vertices, (0, 0, 1.0)).T
    spent = [(step * (free.times(step) - held.times(step))).sum() / (step * held.times(step)).sum()
             for step in (outward, around)]
    assert -0.1 < spent[0] <= 0
    assert spent[1] < -0.4


@pytest.mark.parametrize("seed", range(4))
def test_a_step_brings_the_samples_nearer(seed: int) -> None:
    vertices, faces, samples, met = sampled(seed)
    step = best_step(vertices, faces, samples, met.face, met.places)

    def squares(at: np.ndarray) -> float:
        found = np.einsum("cs,scx->xs", met.places, at[faces[met.face]])
        return float((met.weights * ((samples.exact - found) ** 2).sum(axis=0)).sum())

    assert squares(vertices + step) < 0.2 * squares(vertices)
