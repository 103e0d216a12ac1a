# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary .stl files in blocks."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .atomic import atomic_output
from .off import FileFormatError

_HEAD = 84
_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class StlFile:
    """A binary .stl file; see `pieces.TriangleFile`.

    Raises
    ------
    FileFormatError
        It is text, or cut short.
    OSError
        It cannot be opened.
    """

    dtype = np.dtype(np.float32)
    left_behind: tuple[str, ...] = ()

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        size = self.path.stat().st_size
        with open(self.path, "rb") as file:
            head = file.read(_HEAD)
        if size < _HEAD:
            raise FileFormatError(f"{self.path.name} is no binary .stl file: it has {size} bytes")
        self.face_count = int.from_bytes(head[80:84], "little")
        if size < _HEAD + self.face_count * _FACE.itemsize:
            if head.lstrip().startswith(b"solid"):
                raise FileFormatError(f"{self.path.name} is text: save it as binary to read it in pieces")
            raise FileFormatError(f"{self.path.name} is cut short: it promises {self.face_count} triangles")

    def count(self) -> int:
        """Count the triangles."""
        return self.face_count

    def blocks(self, size: int) -> Iterator[NDArray]:
        """Give the triangles in blocks: (b, 3, 3) float32."""
        with open(self.path, "rb") as file:
            file.seek(_HEAD)
            for first in range(0, self.face_count, size):
                yield np.fromfile(file, _FACE, min(size, self.face_count - first))["corners"].astype(np.float32)

    def sample(self, count: int) -> NDArray:
        """Give a corner of about so many triangles, evenly chosen: (s, 3)."""
        chosen = np.linspace(0, self.face_count - 1, min(self.face_count, count)).astype(np.int64)
        rows = np.memmap(self.path, _FACE, "r", _HEAD, (self.face_count,)) if len(chosen) else np.zeros(0, _FACE)
        return rows["corners"][chosen, 0].astype(np.float32)


def write_stl(path: str | os.PathLike[str], blocks: Iterable[NDArray]) -> None:
    """Write triangles as a binary .stl file.

    Parameters
    ----------
    path
        The file; it appears whole or not at all.
    blocks
        (b, 3, 3) positions each.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    count = 0
    with atomic_output(path) as draft, open(draft, "wb") as file:
        file.write(bytes(_HEAD))
        for corners in blocks:
            faces = np.zeros(len(corners), _FACE)
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            lengths = np.sqrt((normals * normals).sum(axis=1, keepdims=True))
            faces["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
            faces["corners"] = corners
            faces.tofile(file)
            count += len(faces)
        file.seek(80)
        file.write(count.to_bytes(4, "little"))
