# SPDX-License-Identifier: GPL-3.0-or-later
"""What is carried stays what it was, and lines hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.attributes import Attribute, check_attributes
from eso_addon.core.mesh import MeshError
from eso_addon.core.simplify import lod_chain, simplify
from tests.core.shapes import ball, sheet, torus

VERTICES, FACES = ball(4)


def wrapped_uv(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Longitude and latitude, with a seam where the longitude starts anew: (m, 3, 2)."""
    corners = vertices[faces]
    middle = np.arctan2(*corners.mean(axis=1)[:, 1::-1].T) / (2 * np.pi)
    longitude = np.arctan2(corners[..., 1], corners[..., 0]) / (2 * np.pi)
    longitude -= np.round(longitude - middle[:, None])
    return np.stack((longitude, corners[..., 2]), axis=-1)


def areas(uv: np.ndarray) -> np.ndarray:
    one, other = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def places(points: np.ndarray) -> set[bytes]:
    return {row.tobytes() for row in points + 0.0}


@pytest.mark.parametrize("ratio", [0.5, 0.2, 0.05])
def test_a_border_of_materials_stays_where_it_was(ratio: float) -> None:
    upper = (VERTICES[FACES].mean(axis=1)[:, 2] > 0).astype(int)
    result = simplify(VERTICES, FACES, ratio=ratio, attributes={"material": upper})
    material = result.attributes["material"]
    both = places(result.vertices[result.faces[material == 0]].reshape(-1, 3)) & places(
        result.vertices[result.faces[material == 1]].reshape(-1, 3))
    assert both
    assert max(abs(np.frombuffer(place)[2]) for place in both) < 0.01


@pytest.mark.parametrize("ratio", [0.5, 0.2, 0.05])
def test_uv_is_what_the_surface_had_and_nothing_is_turned_over(ratio: float) -> None:
    uv = wrapped_uv(VERTICES, FACES)
    result = simplify(VERTICES, FACES, ratio=ratio, attributes={"uv": uv})
    new = result.attributes["uv"]
    assert new.shape == (len(result.faces), 3, 2)
    assert not (areas(new) * areas(uv)[result.face_map] < 0).any()
    tall = np.abs(result.vertices[result.faces][..., 2] - new[..., 1])
    assert tall.mean() < 0.04
    away = np.abs(new[..., 1]).max(axis=1) < 0.5
    assert np.ptp(new[away][..., 0], axis=1).max() < 0.4  # no triangle is stretched across the seam


def test_linear_values_stay_linear() -> None:
    vertices, faces = sheet(20, 20)
    result = simplify(vertices, faces, ratio=0.1, attributes={"heat": vertices @ [1.0, 2.0, 3.0],
                                                             "uv": vertices[:, :2]})
    assert np.allclose(result.attributes["heat"], result.vertices @ [1, 2, 3])
    assert np.allclose(result.attributes["uv"], result.vertices[:, :2])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_equal_values_stay_equal_to_the_last_bit(dtype: type) -> None:
    normal = np.tile(np.array([0.0, 0.6, 0.8], dtype), (len(FACES), 3, 1))
    result = simplify(VERTICES, FACES, ratio=0.1, attributes={"normal": normal, "weights": np.full(len(VERTICES), 0.1)})
    assert (result.attributes["normal"] == normal[0, 0]).all()
    assert result.attributes["normal"].dtype == dtype
    assert (result.attributes["weights"] == 0.1).all()


def test_all_is_as_it_was_where_nothing_went() -> None:
    rng = np.random.default_rng(1)
    edges = np.sort(np.concatenate((FACES[:, :2], FACES[:, 1:])), axis=1)
    edges = np.unique(edges, axis=0)
    given = {
        "uv": rng.random((len(FACES), 3, 2)), "id": np.arange(len(VERTICES)), "name": np.array([f"v{i}" for i in range(
            len(VERTICES))]), "turn": Attribute(rng.normal(size=(len(VERTICES), 4)), "vertex", "rotation"),
        "matrix": rng.random((len(VERTICES), 4, 4)), "face": np.arange(len(FACES)),
        "crease": Attribute(rng.random(len(edges)), "edge", "label"),
    }
    result = simplify(VERTICES, FACES, ratio=1.0, attributes=given, edges=edges)
    old = result.vertex_map.argsort()
    assert np.array_equal(result.attributes["uv"], given["uv"][result.face_map])
    assert np.array_equal(result.attributes["face"], result.face_map)
    for name in ("id", "name", "matrix"):
        assert np.array_equal(result.attributes[name], given[name][old])
    assert np.array_equal(result.attributes["turn"], given["turn"].values[old])
    found = {tuple(sorted(pair)): value for pair, value in zip(old[result.edges].tolist(), result.attributes["crease"],
                                                              strict=True)}
    assert found == {tuple(pair): value for pair, value in zip(edges.tolist(), given["crease"].values, strict=True)}


def test_marks_follow_their_line() -> None:
    vertices, faces = torus(24, 48)
    ring = np.flatnonzero(np.isclose(np.hypot(vertices[:, 0], vertices[:, 1]), 3))
    pairs = np.sort(np.concatenate((faces[:, :2], faces[:, 1:], faces[:, ::2])), axis=1)
    edges = np.unique(pairs, axis=0)
    marked = np.isin(edges, ring).all(axis=1)
    result = simplify(vertices, faces, ratio=0.05, attributes={"seam": Attribute(marked, "edge", "seam")}, edges=edges)
    ends = result.edges[result.attributes["seam"]]
    assert 3 <= len(ends) < len(ring)
    assert (np.bincount(ends.ravel(), minlength=len(result.vertices))[np.unique(ends)] == 2).all()  # still one ring
    assert np.abs(result.vertices[ends.ravel(), 2]).max() < 0.05


def test_split_vertices_come_out_split_again() -> None:
    uv = wrapped_uv(VERTICES, FACES)
    keys, number = np.unique(np.concatenate((FACES.reshape(-1, 1), uv.reshape(-1, 2).round(9)), axis=1), axis=0,
                             return_inverse=True)
    vertices, faces = VERTICES[keys[:, 0].astype(int)], number.reshape(-1, 3)
    result = simplify(vertices, faces, ratio=0.2, attributes={"uv": keys[:, 1:]})
    new = result.attributes["uv"][result.faces]
    away = np.abs(new[..., 1]).max(axis=1) < 0.5
    assert np.ptp(new[away][..., 0], axis=1).max() < 0.4
    assert len(np.unique(result.vertices, axis=0)) < len(result.vertices)
    used = result.vertex_map >= 0
    assert result.vertex_map[used].max() < len(result.vertices)


@pytest.mark.parametrize("lines", ["locked", "ignored"])
def test_lines_locked_and_ignored(lines: str) -> None:
    upper = (VERTICES[FACES].mean(axis=1)[:, 2] > 0).astype(int)
    border = np.flatnonzero(np.abs(VERTICES[:, 2]) < 1e-9)
    result = simplify(VERTICES, FACES, ratio=0.3, attributes={"material": upper}, material_lines=lines)
    plain = simplify(VERTICES, FACES, ratio=0.3)
    if lines == "locked":
        assert places(VERTICES[border]) <= places(result.vertices)
    else:
        assert np.array_equal(result.vertices, plain.vertices)
        assert np.array_equal(result.faces, plain.faces)


def test_without_lines_the_shape_is_the_same_as_without_attributes() -> None:
    plain = simplify(VERTICES, FACES, ratio=0.2)
    result = simplify(VERTICES, FACES, ratio=0.2, attribute_weight=0, attributes={"color": VERTICES})
    assert np.array_equal(result.vertices, plain.vertices)
    assert np.array_equal(result.faces, plain.faces)
    assert np.array_equal(result.vertex_map, plain.vertex_map)


def test_values_that_are_no_appearance_do_not_change_the_shape() -> None:
    plain = simplify(VERTICES, FACES, ratio=0.2)
    result = simplify(VERTICES, FACES, ratio=0.2, attributes={"weight": Attribute(VERTICES**2, "vertex", "value")})
    assert np.array_equal(result.vertices, plain.vertices)


@pytest.mark.parametrize("kind", ["uv", "color", "normal"])
def test_triangles_stay_where_attributes_bend(kind: str) -> None:
    vertices, faces = sheet(41, 41)
    vertices = vertices / np.ptp(vertices, axis=0).max()
    bend = np.abs(vertices[:, :1] - 0.47)  # from there on the values run back
    values = np.concatenate((bend, vertices[:, 1:2], np.ones_like(bend)), axis=1)
    if kind == "normal":
        values /= np.linalg.norm(values, axis=1, keepdims=True)
    values = values[:, :2] if kind == "uv" else values
    errors = []
    for weight in (0, 1):
        result = simplify(vertices, faces, ratio=0.02, attribute_weight=weight, seam_lines="ignored",
                          attributes={"values": Attribute(values, "vertex", kind)})
        middle = result.vertices[result.faces].mean(axis=1)
        assert np.allclose(middle[:, 2], 0)
        wanted = np.abs(middle[:, 0] - 0.47)
        got = result.attributes["values"][result.faces].mean(axis=1)
        got = got[:, 0] / (got[:, 2] if kind == "normal" else 1)
        errors.append(np.abs(got - wanted).mean())
    assert errors[1] < 0.5 * errors[0]


@given(seed=st.integers(0, 2**31), ratio=st.floats(0.05, 0.9))
@settings(deadline=None, max_examples=15)
def test_any_values_give_a_mesh(seed: int, ratio: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = ball(2)
    scale = 10.0 ** rng.uniform(-30, 30)
    uv = rng.normal(size=(len(faces), 3, 2)) if seed % 2 else vertices[faces][..., :2] ** 3
    result = simplify(vertices, faces, ratio=ratio, attributes={"uv": Attribute(uv * scale, "corner", "uv")})
    assert len(result.faces) < len(faces)
    assert np.isfinite(result.vertices).all()
    assert np.abs(result.vertices).max() < 2


def test_locked_vertices_stay_and_important_ones_keep_more() -> None:
    north = VERTICES[:, 2] > 0.3
    locked = simplify(VERTICES, FACES, ratio=0.6, locked=north)
    assert places(VERTICES[north]) <= places(locked.vertices)
    favoured = simplify(VERTICES, FACES, ratio=0.3, importance=np.where(VERTICES[:, 2] > 0, 50.0, 1.0))
    assert (favoured.vertices[:, 2] > 0.1).sum() > 1.5 * (favoured.vertices[:, 2] < -0.1).sum()


def test_every_level_of_a_chain_carries() -> None:
    levels = lod_chain(VERTICES, FACES, [0.5, 0.1], attributes={"color": VERTICES})
    for level in levels:
        assert np.abs(level.attributes["color"] - level.vertices).max() < 0.15


def test_a_layer_that_jumps_everywhere_holds_nothing() -> None:
    noise = np.random.default_rng(0).random((len(FACES), 3, 2))
    result = simplify(VERTICES, FACES, ratio=0.1, attributes={"uv": noise})
    assert result.reached
    assert "uv differs across most edges" in result.messages[0]


def test_what_is_not_finite_is_taken_as_zero_and_told() -> None:
    uv = wrapped_uv(VERTICES, FACES)
    uv[3, 1] = np.nan
    result = simplify(VERTICES, FACES, ratio=0.3, attributes={"uv": uv})
    assert np.isfinite(result.attributes["uv"]).all()
    assert "uv has 1 values that are not finite" in " ".join(result.messages)
    assert np.isnan(uv[3, 1]).all()


@pytest.mark.parametrize(("attributes", "words"), [
    ({"x": np.zeros(7)}, "fits no"),
    ({"x": Attribute(np.zeros(len(VERTICES)), "face")}, "must begin with"),
    ({"x": Attribute(np.zeros(len(VERTICES)), "nowhere")}, "choose one of"),
    ({"x": Attribute(np.zeros(len(VERTICES)), "vertex", "smell")}, "choose one of"),
    ({"x": Attribute(np.array(["a"] * len(VERTICES)), "vertex", "uv")}, "only numbers"),
    ({"x": np.zeros(len(VERTICES), complex)}, "give numbers"),
    ({"x": [[1], [2, 3]]}, "differ in length"),
])
def test_bad_attributes_are_refused(attributes: dict, words: str) -> None:
    with pytest.raises(MeshError, match=words):
        simplify(VERTICES, FACES, ratio=0.5, attributes=attributes)


@pytest.mark.parametrize("options", [
    {"seam_lines": "maybe"}, {"attribute_weight": -1}, {"line_weight": -1}, {"symmetry": "w"}, {"locked": [1, 2]},
    {"importance": np.full(len(VERTICES), np.nan)},
    {"attributes": {}, "edges": [[0, 10**6]], "locked": VERTICES[:, 0] > 0},
])
def test_bad_options_are_refused(options: dict) -> None:
    with pytest.raises(MeshError):
        simplify(VERTICES, FACES, ratio=0.5, **options)


def test_empty_layers_are_carried() -> None:
    layers = check_attributes({"none": np.zeros((len(VERTICES), 0))}, len(VERTICES), len(FACES)).layers
    assert layers[0].rows.shape == (len(VERTICES), 0)
    assert simplify(VERTICES, FACES, ratio=0.5, attributes={"none": np.zeros((len(VERTICES), 0))}).attributes[
        "none"].shape[1] == 0


def test_a_texture_that_both_sides_share_is_not_folded_over() -> None:
    vertices, faces = sheet(24, 24)
    uv = np.abs(vertices[:, :2] - [12.0, -1.0])
    result = simplify(vertices, faces, ratio=0.1, attributes={"uv": uv})
    assert np.allclose(result.attributes["uv"], np.abs(result.vertices[:, :2] - [12.0, -1.0]), atol=0.05)
    across = result.vertices[result.faces][..., 0]
    assert (across.min(axis=1) >= 11.9).sum() + (across.max(axis=1) <= 12.1).sum() == len(result.faces)
