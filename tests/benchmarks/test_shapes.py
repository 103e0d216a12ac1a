# SPDX-License-Identifier: GPL-3.0-or-later
"""The generated meshes are what they claim to be, and the readers give back what was written."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks import shapes
from benchmarks.readers import Mesh, read_mesh


def edge_counts(faces: np.ndarray) -> np.ndarray:
    """Return how many faces each edge has, after a check that the faces agree on their winding."""
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    return np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)[1]


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("shape", [shapes.scan, shapes.parts])
def test_closed_shapes_are_closed_and_outward(shape: Callable[[int], Mesh]) -> None:
    vertices, faces = shape(3000)
    assert np.all(edge_counts(faces) == 2)
    assert abs(len(faces) - 3000) < 150
    assert volume(vertices, faces) > 0
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))


@pytest.mark.parametrize("shape", [shapes.grid, shapes.cylinder])
def test_open_shapes_have_a_boundary_only(shape: Callable[[int], Mesh]) -> None:
    vertices, faces = shape(3000)
    assert set(edge_counts(faces)) == {1, 2}
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))


def test_the_scan_is_the_same_every_time() -> None:
    assert np.array_equal(shapes.scan(1000)[0], shapes.scan(1000)[0])


def test_parts_are_separate() -> None:
    vertices, faces = shapes.parts(5000)
    edges = len(edge_counts(faces))
    assert len(vertices) - edges + len(faces) == 2 * (len(faces) // 108)


def as_obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a}/1 {b}//2 {c}/1/2" for a, b, c in (faces + 1).tolist()]
    return "\n".join(["# comment", *lines]).encode()


def as_off(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()] + [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    return "\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *lines]).encode()


def as_ply(vertices: np.ndarray, faces: np.ndarray, order: str) -> bytes:
    form = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = f"ply\nformat {form} 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
    head += f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    table = np.zeros(len(faces), dtype=[("n", "u1"), ("corners", order + "i4", 3)])
    table["n"], table["corners"] = 3, faces
    return head.encode() + vertices.astype(order + "f8").tobytes() + table.tobytes()


@pytest.mark.parametrize("ending", ["obj", "off", "little.ply", "big.ply"])
def test_readers_give_back_what_was_written(ending: str, tmp_path: Path) -> None:
    vertices, faces = shapes.scan(300)
    written = {
        "obj": lambda: as_obj(vertices, faces),
        "off": lambda: as_off(vertices, faces),
        "little.ply": lambda: as_ply(vertices, faces, "<"),
        "big.ply": lambda: as_ply(vertices, faces, ">"),
    }[ending]()
    path = tmp_path / f"mesh.{ending}"
    path.write_bytes(written)
    points, triangles = read_mesh(path)
    assert np.array_equal(points, vertices)
    assert np.array_equal(triangles, faces)


def test_readers_split_polygons_and_drop_what_is_unused(tmp_path: Path) -> None:
    path = tmp_path / "quad.obj"
    path.write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n")
    vertices, faces = read_mesh(path)
    assert len(vertices) == 4
    assert faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_an_unknown_ending_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"use \.obj, \.ply or \.off"):
        read_mesh(tmp_path / "mesh.xyz")
