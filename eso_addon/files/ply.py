# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary .ply files in blocks."""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .atomic import atomic_output
from .off import FileFormatError

Ints = NDArray[np.int64]

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
          "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
          "float32": "f4", "float64": "f8"}
_CORNERS = ("vertex_indices", "vertex_index")
_CHUNK = 1 << 20  # bytes at once, where faces differ in size
_COUNTED = 1 << 18  # triangles at once


@dataclass
class _Element:
    """An element of the header: its scalars by name, its lists by the dtypes of count and item."""

    name: str
    count: int
    properties: list[tuple[str, np.dtype, np.dtype | None]] = field(default_factory=list)

    @property
    def row(self) -> np.dtype:
        """The dtype of one row; without lists alone."""
        return np.dtype([(name, kind) for name, kind, _ in self.properties])

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in size."""
        return any(item is not None for _, _, item in self.properties)


class PlyFile:
    """A binary .ply file; see `pieces.TriangleFile`.

    Raises
    ------
    FileFormatError
        It is text, cut short or damaged, or has no vertices and faces.
    OSError
        It cannot be opened.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        elements, offset = _read_header(self.path)
        places: dict[str, tuple[_Element, int]] = {}
        for element in elements:
            places[element.name] = element, offset
            if element.name == "face":
                break  # nobody knows where the next one begins
            if element.has_lists:
                raise FileFormatError(f"{self.path.name} has lists in its element {element.name}: cannot read it in "
                                      "pieces")
            offset += element.count * element.row.itemsize
        if not {"vertex", "face"} <= set(places):
            raise FileFormatError(f"{self.path.name} has no vertices and faces, in this order: nothing to work on")
        self._vertex, self._vertex_start = places["vertex"]
        self._face, self._face_start = places["face"]
        self.vertex_count, self.face_count = self._vertex.count, self._face.count
        names = [name for name, _, _ in self._vertex.properties]
        if not {"x", "y", "z"} <= set(names) or not any(name in _CORNERS and item is not None
                                                        for name, _, item in self._face.properties):
            raise FileFormatError(f"{self.path.name} has no x, y, z and vertex_indices: nothing to work on")
        self.dtype = np.dtype(np.float64 if self._vertex.row["x"].itemsize > 4 else np.float32)
        others = [name for name, _, _ in self._face.properties if name not in _CORNERS]
        self.left_behind = (*(name for name in names if name not in "xyz"), *others)
        least = sum(kind.itemsize for _, kind, _ in self._face.properties) * self.face_count
        if self.path.stat().st_size < self._face_start + least:
            raise FileFormatError(f"{self.path.name} is cut short: it promises {self.face_count} faces")

    def count(self) -> int:
        """Count the triangles; polygons count by the triangles that they become."""
        return sum(len(corners) for corners in self._corners(_COUNTED))

    def blocks(self, size: int) -> Iterator[NDArray]:
        """Give the triangles in blocks: (b, 3, 3) of `dtype`."""
        if self.vertex_count == 0:
            if self.face_count:
                raise FileFormatError(f"{self.path.name} is damaged: it has faces, and no vertices")
            return
        rows = self._rows()
        for corners in self._corners(size):
            if corners.size and (corners.min() < 0 or corners.max() >= self.vertex_count):
                raise FileFormatError(f"{self.path.name} is damaged: a face names a vertex that the file does not have")
            yield np.stack([rows[name][corners] for name in "xyz"], axis=-1).astype(self.dtype, copy=False)
            _let_go(rows)

    def sample(self, count: int) -> NDArray:
        """Give about so many of the vertices, evenly chosen: (s, 3)."""
        rows = self._rows()[:: max(self.vertex_count // count, 1)]
        points = np.stack([rows[name] for name in "xyz"], axis=-1).astype(self.dtype, copy=False)
        _let_go(rows)
        return points

    def _rows(self) -> NDArray:
        return np.memmap(self.path, self._vertex.row, "r", self._vertex_start, (self.vertex_count,))

    def _corners(self, size: int) -> Iterator[Ints]:
        """Give the corners of triangles: quickly as long as all faces are as the first one, then one by one."""
        with open(self.path, "rb") as file:
            file.seek(self._face_start)
            alike = self._alike(file.read(4096))
            file.seek(self._face_start)
            done = 0
            while alike is not None and done < self.face_count:
                row, counts = alike
                wanted = min(size, self.face_count - done)
                place = file.tell()
                faces = np.fromfile(file, row, wanted)
                if len(faces) < wanted or any((faces[name] != count).any() for name, count in counts.items()):
                    file.seek(place)
                    break
                yield _fans(faces[self._list])
                done += wanted
            chunk = b""
            while done < self.face_count:
                more = file.read(_CHUNK)
                chunk += more
                corners, rows, end = self._faces_in(np.frombuffer(chunk, np.uint8), self.face_count - done)
                if rows == 0 and not more:
                    raise FileFormatError(f"{self.path.name} is cut short: it promises {self.face_count} faces")
                yield corners
                done, chunk = done + rows, chunk[end:]

    def _alike(self, first: bytes) -> tuple[np.dtype, dict[str, int]] | None:
        """Return the dtype of faces that are as the first one, and the counts of their lists."""
        fields: list[tuple] = []
        counts: dict[str, int] = {}
        offset = 0
        for name, kind, item in self._face.properties:
            if item is None:
                fields.append((name, kind))
                offset += kind.itemsize
                continue
            if offset + kind.itemsize > len(first):
                return None
            count = int(np.frombuffer(first, kind, 1, offset)[0])
            if not 0 <= count < 256 or (count < 3 and name in _CORNERS):
                return None
            counts["count of " + name] = count
            fields += [("count of " + name, kind), (name, item, (count,))]
            offset += kind.itemsize + count * item.itemsize
        return np.dtype(fields), counts

    @property
    def _list(self) -> str:
        return next(name for name, _, item in self._face.properties if name in _CORNERS and item is not None)

    def _faces_in(self, data: NDArray[np.uint8], most: int) -> tuple[Ints, int, int]:
        """Read the faces that are whole within some bytes: triangles, how many faces, and where they end."""
        length = len(data)
        place = np.arange(length)  # where a face's next property would be, if one began at each byte
        counts, starts, item_type = place, place, self._face.properties[0][1]
        for name, kind, item in self._face.properties:
            if item is None:
                place = place + kind.itemsize
                continue
            count = _at(data, place, kind)
            if name == self._list:
                counts, starts, item_type = count, place + kind.itemsize, item
            place = place + kind.itemsize + np.maximum(count, 0) * item.itemsize
        faces = _chain(np.minimum(place, length + 1), most)
        faces = faces[place[faces] <= length]
        if len(faces) == 0:
            return np.zeros((0, 3), np.int64), 0, 0
        sizes = np.maximum(counts[faces] - 2, 0)
        ends = np.cumsum(sizes)
        first = np.repeat(starts[faces], sizes)
        step = np.arange(len(first)) - np.repeat(ends - sizes, sizes)
        places = np.stack((first, first + (step + 1) * item_type.itemsize, first + (step + 2) * item_type.itemsize), 1)
        return _at(data, places.ravel(), item_type).reshape(-1, 3), len(faces), int(place[faces[-1]])


def _at(data: NDArray[np.uint8], places: Ints, kind: np.dtype) -> Ints:
    """Read a number at each of some places; 0 beyond the end."""
    rows = places[:, None] + np.arange(kind.itemsize)
    return np.append(data, np.uint8(0))[np.minimum(rows, len(data))].view(kind).ravel().astype(np.int64)


def _chain(following: Ints, most: int) -> Ints:
    """Follow the way from 0: each place names the next; ends before the end. By doubling the part that is known."""
    end = len(following)
    jump = np.concatenate((np.minimum(following, end), [end]))
    way = np.zeros(1, np.int64)
    while way[-1] < end and len(way) < most:
        way = np.concatenate((way, jump[way]))
        jump = jump[jump]
    return way[way < end][:most]


def _fans(polygons: NDArray) -> Ints:
    """Turn polygons of one size into triangles around their first corners."""
    corners = polygons.astype(np.int64)
    if corners.shape[1] == 3:
        return corners
    steps = np.arange(1, corners.shape[1] - 1)
    first = np.repeat(corners[:, :1], len(steps), axis=1)
    return np.stack((first, corners[:, steps], corners[:, steps + 1]), axis=-1).reshape(-1, 3)


def _let_go(rows: NDArray) -> None:
    """Give back the memory of what was read of a file; it may be read again."""
    mapped = getattr(rows, "_mmap", None)
    if mapped is not None and hasattr(mapped, "madvise"):
        mapped.madvise(mmap.MADV_DONTNEED)


def _read_header(path: Path) -> tuple[list[_Element], int]:
    """Read the elements of a binary file, and where the first one begins."""
    with open(path, "rb") as file:
        head = file.read(1 << 16)
    end = head.find(b"end_header")
    if not head.startswith(b"ply") or end < 0:
        raise FileFormatError(f"{path.name} is no .ply file: it does not begin with a header")
    start = head.find(b"\n", end) + 1
    order = ""
    elements: list[_Element] = []
    for line in head[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "text"}[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                count, item = np.dtype(order + _TYPES[words[2]]), np.dtype(order + _TYPES[words[3]])
                elements[-1].properties.append((words[4], count, item))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], np.dtype(order + _TYPES[words[1]]), None))
        except (KeyError, IndexError, ValueError, TypeError):
            if order == "text":
                break
            raise FileFormatError(f"{path.name} is damaged: its header says {line.strip()!r}") from None
    if order == "text":
        raise FileFormatError(f"{path.name} is text: save it as binary to read it in pieces")
    if not order or start == 0 or any(element.count < 0 for element in elements):
        raise FileFormatError(f"{path.name} is damaged: its header is not whole")
    return elements, start


def write_ply(path: str | os.PathLike[str], vertices: Iterable[NDArray], faces: Iterable[NDArray],
              dtype: np.dtype | type = np.float32) -> None:
    """Write triangles as a binary .ply file.

    Parameters
    ----------
    path
        The file; it appears whole or not at all.
    vertices
        Blocks of (b, 3) positions.
    faces
        Blocks of (b, 3) vertex indices.
    dtype
        float32 or float64.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    kind = np.dtype(dtype).newbyteorder("<")
    row = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    counts = [0, 0]
    with atomic_output(path) as draft, open(draft, "wb") as file:
        file.write(_header(kind, counts))
        for block in vertices:
            file.write(np.ascontiguousarray(block, kind).tobytes())
            counts[0] += len(block)
        for block in faces:
            rows = np.zeros(len(block), row)
            rows["count"], rows["corners"] = 3, block
            file.write(rows.tobytes())
            counts[1] += len(block)
        file.seek(0)
        file.write(_header(kind, counts))


def _header(kind: np.dtype, counts: list[int]) -> bytes:
    """Make a header; its length does not hang on the counts."""
    word = "double" if kind.itemsize == 8 else "float"
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {counts[0]:<20}",
             *(f"property {word} {axis}" for axis in "xyz"), f"element face {counts[1]:<20}",
             "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(lines).encode()
