# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary .ply and .stl files in blocks: what was written is read, whatever the layout and the size of the blocks."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eso_addon.files.off import FileFormatError
from eso_addon.files.pieces import open_triangles
from eso_addon.files.ply import write_ply
from eso_addon.files.stl import write_stl

NUMBERS = {"i1": "char", "u1": "uchar", "<i2": "short", "<u2": "ushort", "<i4": "int", "<u4": "uint", ">i4": "int",
           ">u1": "uchar", ">u2": "ushort", ">i2": "short", ">u4": "uint"}


def soup(path: Path, size: int = 7) -> np.ndarray:
    triangles = np.concatenate([np.zeros((0, 3, 3)), *open_triangles(path).blocks(size)])
    assert len(triangles) == open_triangles(path).count()
    return triangles


def write_polygons(path: Path, vertices: np.ndarray, polygons: list[list[int]], *, order: str = "<", count: str = "u1",
                   item: str = "i4", before: bool = False, after: bool = False) -> None:
    """Write a .ply file of polygons, with a scalar before and a list after the corners if so wanted."""
    lines = ["ply", f"format binary_{'little' if order == '<' else 'big'}_endian 1.0", "comment made by a test",
             f"element vertex {len(vertices)}", "property float x", "property uchar red", "property float y",
             "property float z", f"element face {len(polygons)}", *(["property short flag"] if before else []),
             f"property list {NUMBERS[np.dtype(order + count).str.replace('|', '')]} "
             f"{NUMBERS[np.dtype(order + item).str.replace('|', '')]} vertex_indices",
             *(["property list uchar float texcoord"] if after else []), "end_header", ""]
    rows = np.zeros(len(vertices), [("x", order + "f4"), ("r", "u1"), ("y", order + "f4"), ("z", order + "f4")])
    rows["x"], rows["y"], rows["z"] = vertices.T
    data = "\n".join(lines).encode() + rows.tobytes()
    for number, polygon in enumerate(polygons):
        if before:
            data += np.array(number, order + "i2").tobytes()
        data += np.array(len(polygon), order + count).tobytes() + np.array(polygon, order + item).tobytes()
        if after:
            data += np.array(number % 3, "u1").tobytes() + np.zeros(number % 3, order + "f4").tobytes()
    path.write_bytes(data)


@given(sizes=st.lists(st.integers(0, 6), max_size=60), alike=st.booleans(), order=st.sampled_from("<>"),
       count=st.sampled_from(["u1", "i1", "u2", "i4"]), item=st.sampled_from(["i4", "u4", "u2", "u1"]),
       before=st.booleans(), after=st.booleans(), block=st.integers(1, 20), seed=st.integers(0, 99))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_polygons_become_fans(tmp_path: Path, sizes: list[int], alike: bool, order: str, count: str, item: str,
                              before: bool, after: bool, block: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((40, 3)).astype(np.float32)
    polygons = [rng.integers(0, 40, 3 if alike else size).tolist() for size in sizes]
    path = tmp_path / "polygons.ply"
    write_polygons(path, vertices, polygons, order=order, count=count, item=item, before=before, after=after)
    wanted = [vertices[[p[0], p[i], p[i + 1]]] for p in polygons for i in range(1, len(p) - 1)]
    assert np.array_equal(soup(path, block), np.array(wanted).reshape(-1, 3, 3))
    assert open_triangles(path).left_behind == ("red", *(["flag"] if before else []), *(["texcoord"] if after else []))


@given(count=st.integers(0, 50), block=st.integers(1, 20), double=st.booleans(), seed=st.integers(0, 99))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_is_read(tmp_path: Path, count: int, block: int, double: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((20, 3)).astype(np.float64 if double else np.float32)
    faces = rng.integers(0, 20, (count, 3))
    write_ply(tmp_path / "a.ply", [vertices[:5], vertices[5:]], np.array_split(faces, 3), vertices.dtype)
    assert np.array_equal(soup(tmp_path / "a.ply", block), vertices[faces])
    write_stl(tmp_path / "a.stl", np.array_split(vertices[faces], 2))
    assert np.array_equal(soup(tmp_path / "a.stl", block), vertices[faces].astype(np.float32))


def test_samples_are_points_of_the_file(tmp_path: Path) -> None:
    vertices = np.random.default_rng(0).standard_normal((1000, 3)).astype(np.float32)
    faces = np.arange(999).reshape(-1, 3)
    write_ply(tmp_path / "a.ply", [vertices], [faces])
    write_stl(tmp_path / "a.stl", [vertices[faces]])
    for name in ("a.ply", "a.stl"):
        points = open_triangles(tmp_path / name).sample(100)
        assert 100 <= len(points) <= 200
        assert {tuple(point) for point in points} <= {tuple(vertex) for vertex in vertices}


HEAD = b"ply\nformat binary_little_endian 1.0\n"
VERTICES = b"element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACES = b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"


@pytest.mark.parametrize(("name", "data", "told"), [
    ("a.ply", b"", "no .ply file"),
    ("a.ply", b"\0" * 200, "no .ply file"),
    ("a.ply", b"ply\nformat ascii 1.0\n" + VERTICES + FACES, "is text"),
    ("a.ply", HEAD + b"element vertex x\nend_header\n", "header says"),
    ("a.ply", HEAD + b"property float x\nend_header\n", "header says"),
    ("a.ply", HEAD + b"element vertex -3\nend_header\n", "not whole"),
    ("a.ply", HEAD + VERTICES + b"end_header\n", "no vertices and faces"),
    ("a.ply", HEAD + FACES, "no vertices and faces"),
    ("a.ply", HEAD + VERTICES + FACES, "cut short"),
    ("a.ply", HEAD + VERTICES + FACES + bytes(36) + b"\3", "cut short"),
    ("a.ply", HEAD + VERTICES + FACES + bytes(36) + b"\3" + bytes(11), "cut short"),
    ("a.ply", HEAD + VERTICES + FACES + bytes(36) + b"\3" + b"\7" * 12, "does not have"),
    ("a.stl", b"", "no binary"),
    ("a.stl", bytes(80) + b"\7\0\0\0" + bytes(50), "cut short"),
    ("a.stl", b"solid a\nfacet normal 0 0 1\n" + b" " * 90, "is text"),
    ("a.obj", b"v 0 0 0\n", "binary .ply or .stl"),
])
def test_bad_files_are_told_in_a_line(tmp_path: Path, name: str, data: bytes, told: str) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileFormatError, match=told):
        soup(tmp_path / name)
