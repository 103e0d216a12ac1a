# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes made by formula, the same on every machine: a scan-like closed shape and the shapes that slow engines down."""

from __future__ import annotations

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]


def _grid_faces(rows: int, columns: int) -> np.ndarray:
    """Return the triangles of a grid of rows x columns quads, vertices numbered row by row."""
    corner = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    a, b, c, d = (corner.ravel() + step for step in (0, 1, columns + 2, columns + 1))
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def cube_sphere(divisions: int) -> Mesh:
    """Return a closed sphere of 12 x divisions^2 triangles: (n, 3) float64 and (m, 3) int64."""
    steps = np.arange(divisions + 1)
    u, v = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
    faces, lattice = _grid_faces(divisions, divisions), []
    for axis in range(3):
        for side in (0, divisions):
            point = np.empty((len(u), 3), dtype=np.int64)
            first, second = (v, u) if side else (u, v)
            point[:, axis], point[:, (axis + 1) % 3], point[:, (axis + 2) % 3] = side, first, second
            lattice.append(point)
    points = np.concatenate(lattice)
    sides = np.concatenate([faces + side * len(u) for side in range(6)])
    keys = (points[:, 0] * (divisions + 1) + points[:, 1]) * (divisions + 1) + points[:, 2]
    _, first_index, numbered = np.unique(keys, return_index=True, return_inverse=True)
    # The tangent evens out the triangles between the middle and the corners of a side.
    cube = np.tan((points[first_index] * 2.0 / divisions - 1.0) * (np.pi / 4))
    return cube / np.linalg.norm(cube, axis=1, keepdims=True), numbered.reshape(-1)[sides]


def scan(triangles: int, seed: int = 0) -> Mesh:
    """Return a closed displaced sphere of about the given number of triangles, with bumps, ridges and scan noise."""
    divisions = max(2, round((triangles / 12) ** 0.5))
    sphere, faces = cube_sphere(divisions)
    random = np.random.default_rng(seed)
    radius = np.ones(len(sphere))
    for octave in range(6):
        for _ in range(4):
            wave = random.normal(size=3)
            phase = sphere @ (wave / np.linalg.norm(wave) * 2.5 * 1.9**octave) + random.uniform(0, 2 * np.pi)
            radius += 0.09 * 0.5**octave * np.sin(phase)
    radius -= 0.12 * np.abs(np.sin(4 * sphere[:, 0] + 2 * sphere[:, 1]))
    radius += random.normal(scale=0.04 / divisions, size=len(sphere))
    return sphere * radius[:, None] * (1.0, 0.8, 1.3), faces


def grid(triangles: int) -> Mesh:
    """Return a flat square grid of about the given number of triangles."""
    side = round((triangles / 2) ** 0.5)
    x, y = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0, 1, side + 1), indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), _grid_faces(side, side)


def cylinder(triangles: int) -> Mesh:
    """Return an open cylinder of about the given number of triangles, as high as it is round."""
    around = round((triangles / 2) ** 0.5)
    faces = _grid_faces(around, around)
    row, column = np.divmod(faces, around + 1)
    angle, z = np.meshgrid(np.arange(around) * (2 * np.pi / around), np.linspace(0, np.pi, around + 1), indexing="ij")
    faces = ((row % around) * (around + 1) + column)[:, ::-1]
    return np.stack([np.cos(angle).ravel(), np.sin(angle).ravel(), z.ravel()], axis=1), faces


def parts(triangles: int) -> Mesh:
    """Return thousands of separate little spheres of 108 triangles on a lattice."""
    sphere, faces = cube_sphere(3)
    count = max(1, round(triangles / len(faces)))
    side = int(np.ceil(count ** (1 / 3)))
    place = np.stack(np.unravel_index(np.arange(count), (side, side, side)), axis=1) * 3.0
    vertices = (place[:, None] + sphere).reshape(-1, 3)
    return vertices, (np.arange(count)[:, None, None] * len(sphere) + faces).reshape(-1, 3)
