# SPDX-License-Identifier: GPL-3.0-or-later
"""Random meshes of every kind that a stream must bring back, and what it means that one is back."""

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Arrays = dict[str, Any]


def grid(rows: int, columns: int, rng: np.random.Generator, *, closed: bool = False,
         flat: bool = False) -> tuple[NDArray, NDArray]:
    """Make a sheet of triangles, or a torus."""
    i, j = np.mgrid[:rows, :columns]
    wide = (rows, columns) if closed else (rows - 1, columns - 1)
    a, b = (x.ravel() for x in np.mgrid[: wide[0], : wide[1]])
    corner = [((a + s) % rows) * columns + (b + t) % columns for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = np.concatenate([np.stack(corner[:3], axis=1), np.stack([corner[0], corner[2], corner[3]], axis=1)])
    if closed:
        u, v = 2 * np.pi * i / rows, 2 * np.pi * j / columns
        points = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1)
    else:
        points = np.stack([i, j, np.zeros_like(i)], axis=-1).astype(float)
    points = points.reshape(-1, 3)
    if not flat:
        points = points + 0.1 * rng.standard_normal(points.shape)
    return points.astype(np.float32), faces


def spoil(points: NDArray, faces: NDArray, rng: np.random.Generator, kind: str) -> tuple[NDArray, NDArray]:
    """Do something to a mesh that other formats cannot take."""
    count = len(points)
    if kind == "soup":
        return points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    if kind == "holes":
        return points, faces[rng.random(len(faces)) > 0.2]
    if kind == "flipped":
        faces = faces.copy()
        faces[: len(faces) // 3] = faces[: len(faces) // 3, ::-1]
        return points, faces
    if kind == "repeated":
        again = faces[rng.integers(0, len(faces), 5)]
        return points, np.concatenate([faces, again, again[:, ::-1], again[:, [0, 0, 1]], np.roll(again, 1, axis=1)])
    if kind == "fins":
        fins = rng.integers(0, count, (6, 3))
        return points, np.concatenate([faces, fins])
    if kind == "pinched":
        points = points.copy()
        points[rng.integers(0, count, 3)] = points[rng.integers(0, count, 3)]
        return points, faces
    if kind == "not finite":
        points = points.copy()
        points[0, 0], points[1, 1], points[2] = np.nan, np.inf, -0.0
        return points, faces
    if kind == "loose":
        return np.concatenate([points, points[:3], points[:2] + 1]), faces
    if kind == "parts":
        return np.concatenate([points, points + 9]), np.concatenate([faces, faces[::-1] + count])
    return points, faces


KINDS = ("plain", "soup", "holes", "flipped", "repeated", "fins", "pinched", "not finite", "loose", "parts")


@st.composite
def meshes(draw: st.DrawFn) -> Arrays:
    """Draw a mesh with attributes on everything, in random order."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    points, faces = grid(draw(st.integers(3, 12)), draw(st.integers(3, 12)), rng, closed=draw(st.booleans()),
                         flat=draw(st.booleans()))
    for kind in draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=2)):
        points, faces = spoil(points, faces, rng, kind)
    order = rng.permutation(len(points))
    points, faces = points[order], np.argsort(order)[faces][rng.permutation(len(faces))]
    mesh: Arrays = {"vertices": points, "faces": faces}
    if draw(st.booleans()):
        mesh["edges"] = rng.integers(0, len(points), (3, 2))
    if draw(st.booleans()):
        seam = rng.random(faces.shape) < 0.1
        mesh["attributes"] = {
            "vertex": {"group": rng.random((len(points), 2)).astype(np.float32)},
            "corner": {"uv": np.where(seam[..., None], 0.5, points[faces][..., :2]).astype(np.float32)},
            "face": {"material": (np.arange(len(faces)) // 20).astype(np.int16), "id": np.arange(len(faces))},
            "side": {"diagonal": rng.random(faces.shape) < 0.3},
        }
        if "edges" in mesh:
            mesh["attributes"]["edge"] = {"crease": rng.random(3).astype(np.float32)}
    return mesh


def same(mesh: Arrays, level: Any) -> bool:  # noqa: ANN401 - a Level
    """Tell whether a level is the mesh, bit for bit and in its order."""
    if level.vertices.tobytes() != np.asarray(mesh["vertices"], np.float32).tobytes():
        return False
    if not np.array_equal(level.faces, mesh["faces"]):
        return False
    for domain, named in mesh.get("attributes", {}).items():
        for name, values in named.items():
            found = level.attributes[domain][name]
            if domain == "edge":  # loose edges come sorted
                values, found = np.sort(values), np.sort(found)
            if found.dtype != values.dtype or found.tobytes() != values.tobytes():
                return False
    edges = np.sort(np.asarray(mesh.get("edges", np.zeros((0, 2), int))), axis=1)
    return sorted(map(tuple, edges.tolist())) == sorted(map(tuple, level.edges.tolist()))


def fingerprint(vertices: NDArray, faces: NDArray, attributes: dict | None = None) -> list:
    """Return all faces by what is at their corners, without any order."""
    places = np.ascontiguousarray(np.asarray(vertices, np.float32)[faces]).view(np.uint32).astype(np.int64)
    columns = [places.reshape(len(faces), 3, -1)]
    for domain, named in (attributes or {}).items():
        if domain == "edge":
            continue
        for values in named.values():
            array = values[faces] if domain == "vertex" else values
            if domain == "face":
                array = np.repeat(array.reshape(len(faces), 1, -1), 3, axis=1)
            array = np.ascontiguousarray(array.reshape(len(faces), 3, -1))
            columns.append(array.view(np.uint8).reshape(len(faces), 3, -1).astype(np.int64))
    rows = np.concatenate(columns, axis=2).tolist()
    return sorted(min(row[k:] + row[:k] for k in range(3)) for row in rows)
