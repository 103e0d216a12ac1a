# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a level fit the original between its vertices too, and nothing that was closed comes open."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.attributes import Attribute
from eso_addon.core.closest import ClosestPoints
from eso_addon.core.fitted import without_turns
from eso_addon.core.least_squares import Equations, Meeting
from eso_addon.core.sampling import face_samples
from eso_addon.core.simplify import SimplifyResult, simplify
from tests.core.shapes import ball, sheet
from tests.core.test_attributes import areas, wrapped_uv

VERTICES, FACES = ball(4)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(0, 60))
def test_the_equations_are_those_of_the_dense_problem(seed: int, columns: int, samples: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(3, 3, rng, 0.5)
    met = Meeting(rng.integers(0, len(faces), samples), rng.dirichlet((1, 1, 1), samples).T, rng.random(samples))
    equations = Equations(vertices, faces, met)
    basis = np.zeros((samples, len(vertices)))
    np.add.at(basis, (np.arange(samples)[:, None], faces[met.face]), met.places.T)
    normal = basis.T @ (met.weights[:, None] * basis)
    step, values = rng.normal(size=(2, columns, len(vertices)))
    damping = equations.times(np.eye(len(vertices))) - normal
    assert np.allclose(damping, np.diag(np.diag(damping)))
    assert (np.diag(damping) > 0).all()
    assert np.allclose(equations.times(step), step @ (normal + damping))
    wanted = rng.normal(size=(columns, samples))
    assert np.allclose(equations.pull(values, wanted), (wanted - values @ basis.T) * met.weights @ basis)
    free = rng.random(len(vertices)) < 0.7
    new = equations.best_values(values, wanted, free)
    assert np.array_equal(new[:, ~free], values[:, ~free])

    def loss(given: np.ndarray) -> np.ndarray:
        far = ((wanted - given @ basis.T) ** 2 * met.weights).sum(axis=1)
        return np.asarray(far + ((given - values) ** 2 * np.diag(damping)).sum(axis=1))

    assert (loss(new) <= loss(values) * (1 + 1e-9) + 1e-12).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 10))
def test_no_triangle_turns_over_however_far_a_step_would_go(seed: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(4, 4, rng)
    uv = vertices[:, :2].T + rng.normal(size=(2, len(vertices))) * 0.2
    step = without_turns(uv, rng.normal(size=uv.shape) * far, faces)
    before, after = areas(uv.T[faces]), areas((uv + step).T[faces])
    assert (after * np.sign(before) >= 0.2 * np.abs(before) - 1e-12).all()


def error_between(result: SimplifyResult, name: str, vertices: np.ndarray, faces: np.ndarray,
                  values: np.ndarray) -> float:
    """Mean distance between a corner attribute at samples of a result and at the nearest points of the original."""
    corners = result.faces.astype(np.int64)
    points, face = face_samples(result.vertices, corners, 4000, np.random.default_rng(0))[:2]
    closest, near, _ = ClosestPoints(vertices, faces).query(points)
    own = _at(result.vertices, corners, result.attributes[name], points, face)
    return float(np.linalg.norm(own - _at(vertices, faces, values, closest, near), axis=1).mean())


def _at(vertices: np.ndarray, faces: np.ndarray, values: np.ndarray, points: np.ndarray,
        face: np.ndarray) -> np.ndarray:
    a, b, c = vertices[faces[face]].transpose(1, 0, 2)
    solved = np.einsum("ijk,ik->ij", np.linalg.pinv(np.stack((b - a, c - a), axis=-1)), points - a)
    shares = np.concatenate((1 - solved.sum(axis=1, keepdims=True), solved), axis=1)
    return np.asarray(np.einsum("ij,ijk->ik", shares, values[face]))


@pytest.mark.parametrize("kind", ["uv", "normal", "color"])
def test_what_is_seen_between_vertices_is_nearer(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, faces = sheet(40, 40)
    x, y = vertices[:, 0] / 40, vertices[:, 1] / 40
    vertices = np.stack((x, y, 0.1 * np.sin(6 * x) * np.cos(5 * y)), axis=1)
    bent = np.stack((x + 0.1 * np.sin(7 * y), y + 0.1 * np.sin(5 * x), 1 + 0.2 * np.sin(9 * x)), axis=1)
    values = (bent[:, :2] if kind == "uv" else bent / np.linalg.norm(bent, axis=1, keepdims=True))[faces]
    given = {"map": Attribute(values, "corner", kind)}
    fitted = error_between(simplify(vertices, faces, ratio=0.05, attributes=given), "map", vertices, faces, values)
    monkeypatch.setattr("eso_addon.core.carrier.fitted", lambda layer, rows, *_: rows)
    plain = error_between(simplify(vertices, faces, ratio=0.05, attributes=given), "map", vertices, faces, values)
    assert fitted < 0.8 * plain


@pytest.mark.parametrize("ratio", [0.5, 0.1, 0.03])
def test_a_line_of_one_layer_opens_no_seam_in_another(ratio: float) -> None:
    material = (VERTICES[FACES].mean(axis=1)[:, 2] > 0.2).astype(int)
    normal = VERTICES / np.linalg.norm(VERTICES, axis=1, keepdims=True)
    result = simplify(VERTICES, FACES, ratio=ratio, attributes={
        "material": material, "uv": wrapped_uv(VERTICES, FACES), "normal": normal[FACES]})
    corners = result.vertices[result.faces].reshape(-1, 3)
    _, place = np.unique(corners, axis=0, return_inverse=True)
    values = result.attributes["normal"].reshape(len(corners), -1)
    first = np.zeros((place.max() + 1, values.shape[1]))
    first[place.ravel()] = values
    assert np.array_equal(first[place.ravel()], values)


def test_a_map_that_fills_its_image_does_not_leave_it() -> None:
    vertices, faces = sheet(30, 30)
    vertices = vertices + np.sin(vertices[:, :1]) * np.cos(vertices[:, 1:2] * 0.7) * [0, 0, 1.0]
    uv = (vertices[:, :2] / 30)[faces]
    new = simplify(vertices, faces, ratio=0.1, attributes={"uv": uv}).attributes["uv"]
    assert new.min() == 0
    assert new.max() == 1


def test_colours_stay_within_what_they_were() -> None:
    color = np.where(VERTICES[:, :1] > 0, [[255, 0, 0, 255]], [[0, 0, 255, 128]]).astype(np.uint8)
    result = simplify(VERTICES, FACES, ratio=0.05, attributes={"color": Attribute(color, "vertex", "color")})
    new = result.attributes["color"]
    assert new.dtype == np.uint8
    assert new[:, 3].min() >= 128
    assert (new[:, 1] == 0).all()
