# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of a level follow those of the original."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core.adjacency import boundary_vertices
from eso_addon.core.curves import Curves
from eso_addon.core.refit import refit
from eso_addon.core.simplify import simplify
from tests.core.shapes import sheet


def outline(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the edges of one face, (2, b)."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, first, counts = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return sides[first[counts == 1]].T


def disc(rings: int, around: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a flat disc of radius one."""
    vertices, faces = sheet(rings, around)
    radius, turn = vertices[:, 1] / rings, vertices[:, 0] * 2 * np.pi / around
    column = np.arange(len(vertices)) % (around + 1)
    number = np.where(column == around, np.arange(len(vertices)) - around, np.arange(len(vertices)))
    number[: around + 1] = 0
    faces = number[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    points = np.stack((radius * np.cos(turn), radius * np.sin(turn), np.zeros(len(turn))), axis=1)
    return points[used], faces.reshape(-1, 3)


def segment_distances(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    share = ((point - start) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-300)
    return np.linalg.norm(start + share.clip(0, 1)[:, None] * along - point, axis=1)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 20))
def test_each_sample_has_the_nearest_edge_at_what_its_ends_became(seed: int, vertices: int, lines: int) -> None:
    rng = np.random.default_rng(seed)
    points, placed = rng.random((30, 3)), rng.random((vertices, 3))
    vertex_map = rng.integers(-1, vertices, 30)
    pairs = rng.integers(0, 30, (2, lines))
    curves = Curves(points, pairs, vertex_map)
    ends = vertex_map[pairs]
    ends = ends[:, (ends >= 0).all(axis=0)]
    assert {tuple(sorted(pair)) for pair in ends.T.tolist() if pair[0] != pair[1]} == set(map(tuple, curves.edges.T))
    edge, shares = curves.look(placed)
    assert np.allclose(shares.sum(axis=0), 1)
    assert (shares >= 0).all()
    known = [pair for pair in pairs.T
             if (vertex_map[pair] >= 0).all() and np.isin(curves.edges, vertex_map[pair]).any()]
    assert len(edge) == len(curves.lengths) == 2 * len(known)
    for sample, pair in enumerate(known + known):
        near = np.flatnonzero(np.isin(curves.edges, vertex_map[pair]).any(axis=0))
        least = segment_distances(curves.exact[:, sample], *placed[curves.edges[:, near]]).min()
        own = (placed[curves.edges[:, edge[sample]]] * shares[:, sample, None]).sum(axis=0)
        assert edge[sample] in near
        assert abs(np.linalg.norm(own - curves.exact[:, sample]) - least) < 1e-9


def test_a_rim_of_few_edges_lies_as_much_outside_as_inside() -> None:
    points, faces = disc(8, 240)
    level, corners = disc(2, 12)
    near = ((points[:, None] - level) ** 2).sum(axis=2).argmin(axis=1)
    rim = outline(points, faces)
    held = refit(level, corners, points, faces, vertex_map=near)
    free = refit(level, corners, points, faces, vertex_map=near, lines=rim)
    away = np.abs(np.linalg.norm(level, axis=1) - 1) > 1e-9
    assert np.array_equal(held.vertices[~away], level[~away])
    reach = np.linalg.norm(free.vertices[~away], axis=1)
    assert (reach > 1.001).all()  # a chord of twelve lies 0.034 within the circle at its middle
    assert (reach < 1.034).all()
    assert np.abs(free.vertices[:, 2]).max() < 1e-7


def test_a_straight_rim_stays_straight_and_locked_lines_stay() -> None:
    vertices, faces = sheet(24, 24)
    bumpy = vertices + np.sin(vertices[:, :1] * 0.7) * np.sin(vertices[:, 1:2] * 0.5) * [0, 0, 1.0]
    result = simplify(bumpy, faces, ratio=0.1)
    low, high = result.vertices.min(axis=0), result.vertices.max(axis=0)
    assert np.allclose(low[:2], 0, atol=0.05)
    assert np.allclose(high[:2], 24, atol=0.05)
    assert np.array_equal(simplify(vertices, faces, ratio=0.1).vertices.max(axis=0), [24, 24, 0])
    locked = simplify(bumpy, faces, ratio=0.3, boundary_lines="locked").vertices
    rim = bumpy[np.unique(outline(bumpy, faces))]
    assert {row.tobytes() for row in rim} <= {row.tobytes() for row in locked}


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.03, 0.6), st.sampled_from([0.0, 0.02, 0.2]))
def test_borders_in_a_plane_of_two_axes_stay_in_it(seed: int, ratio: float, rough: float) -> None:
    """Mirrored halves and tiles of a landscape must still fit."""
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(24, 24)
    x, y = vertices[:, 0] / vertices[:, 0].max(), vertices[:, 1] / vertices[:, 1].max()
    z = 0.2 * np.sin(rng.uniform(2, 9) * x + rng.uniform(0, 6)) * np.cos(rng.uniform(2, 9) * y)
    result = simplify(np.column_stack((x, y, z + rough * rng.random(len(x)))), faces, ratio=ratio)
    on_border = result.vertices[boundary_vertices(result.faces, len(result.vertices)), :2]
    assert ((on_border == 0) | (on_border == 1)).any(axis=1).all()
