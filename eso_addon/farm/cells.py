# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh of any size dealt out to cells of space, on disk, and put together again from the cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError

Ints = NDArray[np.int64]

_SAMPLES = 1 << 18
_LEAST_SAMPLES = 16  # of a cell, to find where it is halved
# where cells are cut, as parts of their points, round by round: the cuts of a round lie inside the cells of another
CUTS = (0.5, 0.36, 0.64)


class Source(Protocol):
    """Where triangles come from; see `files.pieces.TriangleFile`."""

    dtype: np.dtype

    def count(self) -> int:
        """Count the triangles."""

    def blocks(self, size: int) -> Iterator[NDArray]:
        """Give the triangles, about so many at once: (b, 3, 3) positions."""

    def sample(self, count: int) -> NDArray:
        """Give about so many points, evenly chosen: (s, 3)."""


@dataclass(frozen=True)
class Tree:
    """Cells as the leaves of a tree of cuts across the axes.

    Attributes
    ----------
    axis : ndarray, (t,) int64
        Of each cut, -1 at a leaf.
    place : ndarray, (t,) float64
        Points below it go to the first child.
    child : ndarray, (t,) int64
        The first of two, or the number of the leaf.
    leaves : int
    """

    axis: Ints
    place: NDArray[np.float64]
    child: Ints
    leaves: int

    def cell_of(self, points: NDArray) -> Ints:
        """Return the cell of each of (n, 3) points; equal points are in one cell."""
        node = np.zeros(len(points), np.int64)
        while True:
            inner = np.flatnonzero(self.axis.take(node) >= 0)
            if len(inner) == 0:
                return self.child.take(node)
            here = node.take(inner)
            node[inner] = self.child.take(here) + (points[inner, self.axis.take(here)] >= self.place.take(here))


def plant(points: NDArray, most: float, cut: float) -> Tree:
    """Cut space until no cell has more than so many of the sampled points.

    Parameters
    ----------
    points : ndarray, (s, 3)
    most : float
    cut : float
        The part of a cell's points below its cut.
    """
    axis, place, child = [-1], [0.0], [0]
    waiting, leaves = [(0, points)], 0
    while waiting:
        node, here = waiting.pop()
        extent = np.ptp(here, axis=0) if len(here) else np.zeros(3)
        along = int(np.argmax(extent))
        at = np.partition(here[:, along], int(len(here) * cut))[int(len(here) * cut)] if len(here) else 0.0
        below = here[:, along] < at
        if len(here) <= max(most, _LEAST_SAMPLES) or not below.any():
            child[node], leaves = leaves, leaves + 1
            continue
        axis[node], place[node], child[node] = along, float(at), len(axis)
        waiting += [(len(axis), here[below]), (len(axis) + 1, here[~below])]
        axis += [-1, -1]
        place += [0.0, 0.0]
        child += [0, 0]
    return Tree(np.array(axis), np.array(place), np.array(child), leaves)


def deal(source: Source, folder: Path, faces: int, most: int, cut: float, block: int) -> tuple[Ints, float]:
    """Deal triangles out to files of cells.

    A triangle with corners in several cells goes to the first of these. Such triangles stay as they are, so that
    neither side of a border changes: `cell_N.mixed` holds them, `cell_N.inner` the others, and `cell_N.held` the
    points of this cell that others' triangles have.

    Parameters
    ----------
    source
    folder
    faces
        About how many there are.
    most
        About how many a cell may have.
    cut
        See `plant`.
    block
        Triangles at once.

    Returns
    -------
    counts : ndarray, (cells,) int64
        Triangles of each cell.
    size : float
        Largest extent along an axis.

    Raises
    ------
    MeshError
        A coordinate is not finite.
    """
    points = source.sample(_SAMPLES)
    points = points[np.isfinite(points).all(axis=1)]
    tree = plant(points, len(points) * most / max(faces, 1), cut)
    counts = np.zeros(tree.leaves, np.int64)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for corners in source.blocks(block):
        corners = corners + corners.dtype.type(0)  # of -0 and 0 the bits are the same then
        flat = corners.reshape(-1, 3)
        if not np.isfinite(flat).all():
            raise MeshError("a face has a coordinate that is not finite: delete or mend it")
        if len(flat):
            low, high = np.minimum(low, flat.min(axis=0)), np.maximum(high, flat.max(axis=0))
        cells = tree.cell_of(flat).reshape(-1, 3)
        owner = cells.min(axis=1)
        mixed = (cells != owner[:, None]).any(axis=1)
        counts += np.bincount(owner, minlength=len(counts))
        _append(folder, "inner", owner[~mixed], corners[~mixed])
        _append(folder, "mixed", owner[mixed], corners[mixed])
        foreign = (cells != owner[:, None])[mixed]
        _append(folder, "held", cells[mixed][foreign], corners[mixed][foreign])
    return counts, float((high - low).max()) if counts.any() else 0.0


def _append(folder: Path, kind: str, cell: Ints, values: NDArray) -> None:
    """Append values to the files of their cells."""
    order = np.argsort(cell, kind="stable")
    cell, values = cell.take(order), values.take(order, axis=0)
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    for start, stop in zip(starts, [*starts[1:], len(cell)], strict=False):
        with open(folder / f"cell_{cell[start]}.{kind}", "ab") as file:
            file.write(values[start:stop].tobytes())


@dataclass(frozen=True)
class Joined:
    """The levels of all cells as one mesh, still on disk; points that cells share are one vertex.

    Attributes
    ----------
    folder : Path
    cells : list of int
        Those with faces.
    shared : ndarray, (h, 3) float64
        Points that are held, each once: the first vertices.
    """

    folder: Path
    cells: list[int]
    shared: NDArray[np.float64]
    dtype = np.dtype(np.float64)

    @classmethod
    def of(cls, folder: Path, cells: list[int]) -> Joined:
        """Find the points that cells share."""
        held = [np.load(folder / f"points_{cell}.npy")[np.load(folder / f"held_{cell}.npy")] for cell in cells]
        return cls(folder, cells, np.unique(np.concatenate([np.zeros((0, 3)), *held]), axis=0))

    def count(self) -> int:
        """Count the triangles."""
        return sum(len(np.load(self.folder / f"corners_{cell}.npy", mmap_mode="r")) for cell in self.cells)

    def vertices(self) -> Iterator[NDArray[np.float64]]:
        """Give the vertices in blocks."""
        yield self.shared
        for cell in self.cells:
            points, _, held = self._load(cell)
            yield points[~held]

    def faces(self) -> Iterator[Ints]:
        """Give the faces in blocks, in numbers of these vertices."""
        ahead = len(self.shared)
        rows = _as_rows(self.shared)
        for cell in self.cells:
            points, corners, held = self._load(cell)
            number = np.zeros(len(points), np.int64)
            number[held] = np.searchsorted(rows, _as_rows(points[held]))
            number[~held] = ahead + np.arange(np.count_nonzero(~held))
            ahead += int(np.count_nonzero(~held))
            yield number[corners]

    def blocks(self, size: int) -> Iterator[NDArray[np.float64]]:
        """Give the triangles in blocks."""
        for cell in self.cells:
            points, corners, _ = self._load(cell)
            for start in range(0, len(corners), size):
                yield points[corners[start : start + size]]

    def sample(self, count: int) -> NDArray[np.float64]:
        """Give about so many points, evenly chosen."""
        sizes = [len(np.load(self.folder / f"points_{cell}.npy", mmap_mode="r")) for cell in self.cells]
        step = max(sum(sizes) // count, 1)
        return np.concatenate([np.load(self.folder / f"points_{cell}.npy")[::step] for cell in self.cells])

    def _load(self, cell: int) -> tuple[NDArray[np.float64], Ints, NDArray[np.bool_]]:
        points, corners, held = (np.load(self.folder / f"{kind}_{cell}.npy") for kind in ("points", "corners", "held"))
        return points, corners, held


def _as_rows(points: NDArray[np.float64]) -> NDArray:
    """Give points as single values that are ordered by x, y, z."""
    return np.ascontiguousarray(points).view([("x", np.float64), ("y", np.float64), ("z", np.float64)]).ravel()
