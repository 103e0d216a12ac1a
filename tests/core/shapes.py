# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that the tests of the core make, and what is true of a mesh: its pieces and their topology."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eso_addon.core.adjacency import components, corner_fans, unique_edges, vertex_components

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mesh = tuple[Floats, Ints]


def quads(rows: int, columns: int, *, around: bool = False, along: bool = False) -> Ints:
    """Return the triangles of a grid of quads on (rows + 1) * (columns + 1) vertices, wrapped where asked."""
    row, column = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    wide, high = columns + (not around), rows + (not along)
    a, b = row * wide + column, row * wide + (column + 1) % wide
    d, c = (row + 1) % high * wide + column, (row + 1) % high * wide + (column + 1) % wide
    return np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))


def sheet(rows: int, columns: int, rng: np.random.Generator | None = None, bump: float = 0.0) -> Mesh:
    """Return an open square sheet; with `rng` its diagonals run at random."""
    y, x = (a.ravel().astype(float) for a in np.meshgrid(np.arange(rows + 1), np.arange(columns + 1), indexing="ij"))
    faces = quads(rows, columns)
    vertices = np.stack((x, y, np.zeros(len(x))), 1)
    if rng is not None:
        half = len(faces) // 2
        turned = np.flatnonzero(rng.random(half) < 0.5)
        a, b, c = faces[turned].T
        d = faces[half + turned, 2]
        faces[turned], faces[half + turned] = np.stack((a, b, d), 1), np.stack((b, c, d), 1)
        vertices[:, 2] = bump * rng.normal(size=len(x))
    return vertices, faces


def tube(rows: int, columns: int) -> Mesh:
    """Return an open cylinder."""
    y, x = (a.ravel() for a in np.meshgrid(np.arange(rows + 1), np.arange(columns), indexing="ij"))
    turn = x * (2 * np.pi / columns)
    return np.stack((np.cos(turn), np.sin(turn), y * (2 * np.pi / columns)), 1), quads(rows, columns, around=True)


def torus(rows: int, columns: int) -> Mesh:
    """Return a closed surface with one handle."""
    y, x = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    u, v = y * (2 * np.pi / rows), x * (2 * np.pi / columns)
    ring = 2 + np.cos(v)
    vertices = np.stack((ring * np.cos(u), ring * np.sin(u), np.sin(v)), 1)
    return vertices, quads(rows, columns, around=True, along=True)


def ball(level: int) -> Mesh:
    """Return a closed sphere of 8 * 4**level triangles, an octahedron refined."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(level):
        sides = np.concatenate((faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]))
        edges, number = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        middle = vertices[edges].sum(axis=1)
        ab, bc, ca = number.reshape(3, -1) + len(vertices)
        vertices = np.concatenate((vertices, middle / np.linalg.norm(middle, axis=1, keepdims=True)))
        a, b, c = faces.T
        faces = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return vertices, faces


def mobius(columns: int, rows: int = 1) -> Mesh:
    """Return a strip with one side."""
    wide = rows + 1
    y, x = (a.ravel() for a in np.meshgrid(np.arange(columns), np.arange(wide), indexing="ij"))
    turn, across = y * (2 * np.pi / columns), (x / rows - 0.5) * 0.8
    ring = 1 + across * np.cos(turn / 2)
    vertices = np.stack((ring * np.cos(turn), ring * np.sin(turn), across * np.sin(turn / 2)), 1)
    faces = quads(columns, rows)
    beyond = faces >= columns * wide  # the last row is the first one upside down
    return vertices, np.where(beyond, rows - (faces - columns * wide), faces)


def double_cone(count: int, height: float = 0.5) -> Mesh:
    """Return a closed double cone: two vertices of very high valence."""
    turn = np.arange(count) * (2 * np.pi / count)
    rim = np.stack((np.cos(turn), np.sin(turn), np.zeros(count)), 1)
    ids = np.arange(2, count + 2)
    up = np.stack((np.zeros(count, np.int64), ids, np.roll(ids, -1)), 1)
    down = np.stack((np.ones(count, np.int64), np.roll(ids, -1), ids), 1)
    return np.concatenate(([[0, 0, height], [0, 0, -height]], rim)), np.concatenate((up, down))


def fan(count: int) -> Mesh:
    """Return an open cone of so many faces around vertex 0."""
    vertices, faces = double_cone(count)
    keep = np.delete(np.arange(count + 2), 1)
    return vertices[keep], np.where(faces[:count] > 1, faces[:count] - 1, 0)


def tetrahedron() -> Mesh:
    """Return the smallest closed surface."""
    return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float), np.array(
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def joined(*meshes: Mesh, gap: float = 5.0) -> Mesh:
    """Return meshes side by side as one."""
    starts = np.cumsum([0] + [len(v) for v, _ in meshes])
    vertices = np.concatenate([v + [gap * i, 0, 0] for i, (v, _) in enumerate(meshes)])
    return vertices, np.concatenate([f + start for start, (_, f) in zip(starts, meshes, strict=False)])


def many(mesh: Mesh, count: int) -> Mesh:
    """Return so many copies of a mesh in a row."""
    return joined(*[mesh] * count)


def touching(one: Mesh, other: Mesh) -> Mesh:
    """Return two meshes that share a vertex, the first of each."""
    vertices, faces = joined(one, (other[0] - other[0][0] + one[0][0], other[1]), gap=0.0)
    return vertices, np.where(faces == len(one[0]), 0, faces)


def finned(mesh: Mesh, faces_of: int = 1) -> Mesh:
    """Return a mesh with a further face on the first edge of its first faces."""
    vertices, faces = mesh
    fins = faces[:faces_of].copy()
    fins[:, 2] = len(vertices) + np.arange(faces_of)
    tips = vertices[faces[:faces_of]].mean(axis=1) * 1.5 + 0.3
    return np.concatenate((vertices, tips)), np.concatenate((faces, fins))


def noisy(mesh: Mesh, rng: np.random.Generator, amount: float) -> Mesh:
    """Return a mesh with all vertices displaced at random."""
    return mesh[0] + amount * rng.normal(size=mesh[0].shape), mesh[1]


def holed(mesh: Mesh, rng: np.random.Generator, share: float) -> Mesh:
    """Return a mesh without a random part of its faces: boundaries, pinched vertices, pieces."""
    keep = rng.random(len(mesh[1])) >= share
    keep[0] = True
    return mesh[0], mesh[1][keep]


def shuffled(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """Return a mesh with vertices, faces and corners in another order, and some vertices that no face uses."""
    vertices, faces = mesh
    place = rng.permutation(len(vertices) + 3)[: len(vertices)]
    moved = rng.normal(size=(len(vertices) + 3, 3))
    moved[place] = vertices
    faces = place[faces[rng.permutation(len(faces))]]
    turn = (np.arange(3) + rng.integers(0, 3, (len(faces), 1))) % 3
    return moved, np.take_along_axis(faces, turn, axis=1)


def turned(mesh: Mesh, rng: np.random.Generator, share: float = 0.5) -> Mesh:
    """Return a mesh with some faces wound the other way round."""
    over = rng.random(len(mesh[1])) < share
    return mesh[0], np.where(over[:, None], mesh[1][:, ::-1], mesh[1])


def cut_along_seams(mesh: Mesh, patch: Ints) -> Mesh:
    """Return a mesh whose vertices are there once for each patch of faces, as importers split along seams."""
    count = int(patch.max()) + 1
    keys, faces = np.unique((mesh[1] * count + patch[:, None]).ravel(), return_inverse=True)
    return mesh[0][keys // count], faces.reshape(-1, 3)


def soup(rng: np.random.Generator, vertices: int, faces: int) -> Mesh:
    """Return faces between random vertices, many of them at equal places: degenerate, repeated, not manifold."""
    return rng.integers(0, 4, (vertices, 3)).astype(float), rng.integers(0, vertices, (faces, 3))


def manifold(seed: int) -> Mesh:
    """Return a random manifold mesh, of one or several pieces, closed or open, wound consistently."""
    rng = np.random.default_rng(seed)
    makers = (
        lambda: sheet(int(rng.integers(1, 7)), int(rng.integers(1, 7)), rng, 0.4),
        lambda: tube(int(rng.integers(1, 6)), int(rng.integers(3, 8))),
        lambda: torus(int(rng.integers(3, 7)), int(rng.integers(3, 7))),
        lambda: ball(int(rng.integers(0, 3))),
        lambda: double_cone(int(rng.integers(3, 40))),
        lambda: fan(int(rng.integers(3, 40))),
        tetrahedron,
    )
    pieces = [makers[rng.integers(len(makers))]() for _ in range(rng.integers(1, 4))]
    return shuffled(noisy(joined(*pieces), rng, float(rng.choice([0.0, 1e-6, 0.05, 0.3]))), rng)


def pinched(seed: int) -> Mesh:
    """Return a random mesh with at most two faces at an edge, with boundaries and pinched vertices."""
    rng = np.random.default_rng(seed)
    return holed(manifold(seed), rng, float(rng.choice([0.05, 0.2, 0.5])))


def anything(seed: int) -> Mesh:
    """Return a random mesh that may break every rule: fins, pinches, one side, windings at odds, bad faces."""
    rng = np.random.default_rng(seed)
    kind = rng.integers(6)
    if kind == 0:
        return soup(rng, int(rng.integers(3, 40)), int(rng.integers(1, 80)))
    if kind == 1:
        return turned(pinched(seed), rng)
    if kind == 2:
        return noisy(finned(ball(2), int(rng.integers(1, 20))), rng, 0.1)
    if kind == 3:
        return noisy(mobius(int(rng.integers(3, 20)), int(rng.integers(1, 5))), rng, 0.02)
    if kind == 4:
        return touching(noisy(ball(1), rng, 0.1), noisy(sheet(4, 4), rng, 0.1))
    # coordinates on a coarse lattice: the weld closes holes, folds sheets and joins pieces
    vertices, faces = pinched(seed)
    return np.round(vertices * 2) / 2, faces


def drained(steps: Generator[Any, None, Any], most: int = 100_000) -> tuple[list[Any], Any]:
    """Return what a generator yields, and what it returns; it must not go on without end."""
    yielded: list[Any] = []
    while True:
        assert len(yielded) <= most, "it goes on without end"
        try:
            yielded.append(next(steps))
        except StopIteration as end:
            return yielded, end.value


def edge_uses(faces: Ints) -> Ints:
    """Return how many faces each edge has, (e,)."""
    return unique_edges(faces, int(faces.max(initial=-1)) + 1)[1]


def euler(faces: Ints, piece: Ints) -> Counter[int]:
    """Return the Euler characteristic of each piece; `piece` is the piece of each vertex."""
    edges, _ = unique_edges(faces, len(piece))
    total = Counter(piece[np.unique(faces)].tolist())
    total.subtract(Counter(piece[edges[:, 0]].tolist()))
    total.update(Counter(piece[faces[:, 0]].tolist()))
    return total


def topology(faces: Ints) -> Counter[tuple[int, int]]:
    """Return Euler characteristic and number of boundary loops of each piece, pinched vertices taken apart."""
    apart = corner_fans(faces, int(faces.max(initial=-1)) + 1)
    count = int(apart.max(initial=-1)) + 1
    piece = vertex_components(apart, count)
    edges, uses = unique_edges(apart, count)
    rims = edges[uses == 1]
    heads = np.unique(components(count, rims[:, 0], rims[:, 1])[rims[:, 0]], return_index=True)[1]
    loops = Counter(piece[rims[heads, 0]].tolist())
    return Counter((value, loops[number]) for number, value in euler(apart, piece).items())


def read_obj(path: Path) -> Mesh:
    """Return vertices and triangles of a plain .obj file."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for words in (line.split() for line in path.read_text().splitlines()):
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            corners = [number - 1 if number > 0 else len(vertices) + number for number in numbers]
            faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return np.array(vertices), np.array(faces)
