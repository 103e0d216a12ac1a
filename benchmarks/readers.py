# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the benchmark's meshes (.obj, .ply, .off) with numpy: positions and triangles, nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]

PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


def read_mesh(path: Path) -> Mesh:
    """Read one mesh.

    Parameters
    ----------
    path : Path
        File whose name ends in .obj, .ply or .off.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        Polygons are split into fans; vertices that no face uses are dropped.

    Raises
    ------
    ValueError
        If the ending is unknown or the file is not of that format.
    """
    readers = {".obj": _read_obj, ".ply": _read_ply, ".off": _read_off}
    if path.suffix.lower() not in readers:
        raise ValueError(f"{path.name}: unknown ending; use .obj, .ply or .off")
    vertices, faces = readers[path.suffix.lower()](path)
    used, numbered = np.unique(faces, return_inverse=True)
    return np.ascontiguousarray(vertices[used]), numbered.reshape(-1, 3).astype(np.int64)


def _fans(polygons: list[list[int]]) -> np.ndarray:
    """Split polygons into triangles that share their first corner."""
    return np.array([(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)], dtype=np.int64)


def _read_obj(path: Path) -> Mesh:
    lines = path.read_text(errors="replace").splitlines()
    vertices = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], dtype=np.float64)
    corners = [[int(word.split("/")[0]) for word in line.split()[1:]] for line in lines if line.startswith("f ")]
    faces = _fans(corners)
    return vertices, np.where(faces > 0, faces - 1, faces + len(vertices))


def _read_off(path: Path) -> Mesh:
    lines = [line for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]
    if lines[0].strip() != "OFF":
        raise ValueError(f"{path.name}: not an OFF file")
    count, polygons = (int(word) for word in lines[1].split()[:2])
    vertices = np.array([line.split()[:3] for line in lines[2 : 2 + count]], dtype=np.float64)
    rows = ([int(word) for word in line.split()] for line in lines[2 + count : 2 + count + polygons])
    return vertices, _fans([row[1 : 1 + row[0]] for row in rows])


def _ply_header(data: bytes) -> tuple[str, list[tuple[str, int, list[list[str]]]], int]:
    """Return the format, the elements (name, count, properties) and where the body starts."""
    end = data.index(b"end_header")
    body = data.index(b"\n", end) + 1
    elements: list[tuple[str, int, list[list[str]]]] = []
    form = ""
    for line in data[:end].decode("ascii").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    return form, elements, body


def _read_ply(path: Path) -> Mesh:
    data = path.read_bytes()
    form, elements, body = _ply_header(data)
    kinds = [(name, count) for name, count, _ in elements[:2]]
    if [name for name, _ in kinds] != ["vertex", "face"]:
        raise ValueError(f"{path.name}: needs the elements vertex and face, in this order")
    (_, vertex_count, vertex_properties), (_, face_count, face_properties) = elements[:2]
    if form == "ascii":
        words = data[body:].split(b"\n")
        vertices = np.array([row.split()[:3] for row in words[:vertex_count]], dtype=np.float64)
        rows = ([int(word) for word in row.split()] for row in words[vertex_count : vertex_count + face_count])
        return vertices, _fans([row[1 : 1 + row[0]] for row in rows])
    order = "<" if form == "binary_little_endian" else ">"
    vertex_type = np.dtype([(p[-1], order + PLY_TYPES[p[0]]) for p in vertex_properties])
    table = np.frombuffer(data, vertex_type, vertex_count, body)
    count_type, index_type = (order + PLY_TYPES[word] for word in face_properties[0][1:3])
    face_type = np.dtype([("n", count_type), ("corners", index_type, 3)])
    triangles = np.frombuffer(data, face_type, face_count, body + vertex_type.itemsize * vertex_count)
    if np.any(triangles["n"] != 3):
        raise ValueError(f"{path.name}: a binary PLY must hold triangles only")
    return np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1), triangles["corners"].astype(np.int64)
