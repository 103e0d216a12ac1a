# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary .ply and .stl files of any size, read as triangles in blocks: each corner by its position."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .off import FileFormatError
from .ply import PlyFile
from .stl import StlFile

ENDINGS = (".ply", ".stl")


class TriangleFile(Protocol):
    """A file of triangles.

    Attributes
    ----------
    face_count : int
        As the file tells; polygons count once.
    dtype : dtype
        Of the positions.
    left_behind : tuple of str
        What it holds besides.
    """

    face_count: int
    dtype: np.dtype
    left_behind: tuple[str, ...]

    def count(self) -> int:
        """Count the triangles."""

    def blocks(self, size: int) -> Iterator[NDArray]:
        """Give the triangles, about so many at once: (b, 3, 3) positions."""

    def sample(self, count: int) -> NDArray:
        """Give about so many points, evenly chosen: (s, 3)."""


def open_triangles(path: str | os.PathLike[str]) -> TriangleFile:
    """Open a binary .ply or .stl file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    TriangleFile

    Raises
    ------
    FileFormatError
        It is of another kind, text, cut short, or damaged.
    OSError
        It cannot be opened.
    """
    ending = Path(path).suffix.lower()
    if ending == ".ply":
        return PlyFile(path)
    if ending == ".stl":
        return StlFile(path)
    raise FileFormatError(f"{Path(path).name} cannot be read in pieces: save it as binary .ply or .stl")
