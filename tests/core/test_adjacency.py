# SPDX-License-Identifier: GPL-3.0-or-later
"""Adjacency against the same words said with dictionaries and sets."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eso_addon.core import adjacency as adj
from eso_addon.core.adjacency import Ints


@st.composite
def any_faces(draw: st.DrawFn) -> tuple[int, Ints]:
    """Random triangles on few vertices: boundaries, pinches, edges of many faces, repeated faces."""
    count = draw(st.integers(3, 12))
    corner = st.integers(0, count - 1)
    face = st.tuples(corner, corner, corner).filter(lambda f: len(set(f)) == 3)
    return count, np.array(draw(st.lists(face, max_size=25)), dtype=np.int64).reshape(-1, 3)


def sides(faces: Ints) -> Counter[tuple[int, ...]]:
    return Counter(tuple(sorted((f[i], f[(i + 1) % 3]))) for f in faces.tolist() for i in range(3))


def groups(pairs: Iterable[Iterable[int]], nodes: Iterable[int]) -> set[frozenset[int]]:
    """Return the connected components as a set of frozen sets."""
    of = {node: {node} for node in nodes}
    for a, b in pairs:
        if of[a] is not of[b]:
            of[a] |= of[b]
            for node in of[b]:
                of[node] = of[a]
    return {frozenset(group) for group in of.values()}


@given(any_faces())
def test_edges_and_their_kinds(mesh: tuple[int, Ints]) -> None:
    count, faces = mesh
    expected = sides(faces)
    edges, face_counts = adj.unique_edges(faces, count)
    assert [tuple(e) for e in edges.tolist()] == sorted(expected)
    assert face_counts.tolist() == [expected[tuple(e)] for e in edges.tolist()]
    boundary = {e for e, k in expected.items() if k == 1}
    assert {tuple(e) for e in adj.boundary_edges(faces, count).tolist()} == boundary
    assert set(np.flatnonzero(adj.boundary_vertices(faces, count)).tolist()) == {v for e in boundary for v in e}
    many = {e for e, k in expected.items() if k > 2}
    assert {tuple(e) for e in adj.nonmanifold_edges(faces, count).tolist()} == many


@given(any_faces())
def test_rings_and_stars(mesh: tuple[int, Ints]) -> None:
    count, faces = mesh
    ring, star = defaultdict(set), defaultdict(list)
    for a, b in sides(faces):
        ring[a].add(b)
        ring[b].add(a)
    for face, corners in enumerate(faces.tolist()):
        for corner in corners:
            star[corner].append(face)
    for found, expected in ((adj.one_rings(faces, count), ring), (adj.stars(faces, count), star)):
        offsets, members = found
        assert offsets[0] == 0
        assert offsets[-1] == len(members)
        for v in range(count):
            assert members[offsets[v] : offsets[v + 1]].tolist() == sorted(expected[v])


@given(any_faces())
def test_a_vertex_is_manifold_if_its_link_is_one_path_or_one_cycle(mesh: tuple[int, Ints]) -> None:
    count, faces = mesh
    for v, found in enumerate(adj.nonmanifold_vertices(faces, count).tolist()):
        link = [tuple(set(f) - {v}) for f in faces.tolist() if v in f]
        nodes = {w for edge in link for w in edge}
        degrees = Counter(w for edge in link for w in edge)
        one_fan = len(groups(link, nodes)) <= 1 and max(degrees.values(), default=0) <= 2
        assert found == (not one_fan)


@given(st.integers(1, 30), st.data())
def test_components_of_any_graph(count: int, data: st.DataObject) -> None:
    node = st.integers(0, count - 1)
    pairs = data.draw(st.lists(st.tuples(node, node), max_size=40))
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    labels = adj.components(count, ends[:, 0], ends[:, 1])
    found = {frozenset(np.flatnonzero(labels == k).tolist()) for k in range(labels.max() + 1)}
    assert found == groups(pairs, range(count))
    firsts = [int(np.flatnonzero(labels == k)[0]) for k in range(labels.max() + 1)]
    assert firsts == sorted(firsts)


@pytest.mark.parametrize("make", [lambda n: np.arange(n), lambda n: np.arange(n)[::-1], lambda n: np.arange(n) * 7 % n])
def test_a_long_chain_is_one_component(make: Callable[[int], Ints]) -> None:
    nodes = make(10_000)
    assert adj.components(10_000, nodes[:-1], nodes[1:]).max() == 0


def test_loose_vertices_are_components_of_their_own() -> None:
    assert adj.vertex_components(np.array([[0, 2, 4]]), 6).tolist() == [0, 1, 0, 2, 0, 3]


def test_no_faces() -> None:
    faces = np.zeros((0, 3), dtype=np.int64)
    for count in (0, 4):
        assert len(adj.unique_edges(faces, count)[0]) == 0
        assert adj.one_rings(faces, count)[0].tolist() == [0] * (count + 1)
        assert adj.stars(faces, count)[0].tolist() == [0] * (count + 1)
        assert not adj.nonmanifold_vertices(faces, count).any()
        assert adj.vertex_components(faces, count).tolist() == list(range(count))


@settings(max_examples=30)
@given(st.lists(st.integers(0, 2**62), max_size=50), st.booleans())
def test_sorting_order_is_stable(keys: list[int], small: bool) -> None:
    values = np.array(keys, dtype=np.int64) % (7 if small else 2**62)
    assert adj.sorting_order(values).tolist() == np.argsort(values, kind="stable").tolist()
