# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive meshes: made, saved, loaded, and any level of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..core.mesh import Ints, MeshError
from ..core.steps import run_to_end
from ..files.atomic import atomic_output
from .errors import StreamError
from .finest import finest, side_rows
from .mesh_codec import EncodedMesh, encode_mesh
from .patches import Patches, make_patches
from .source import Attributes, make_source
from .stream import decode, encode

Made = TypeVar("Made")


@dataclass(frozen=True)
class Level:
    """One level of a progressive mesh.

    Attributes
    ----------
    vertices : ndarray, (k, 3) float32
    faces : ndarray, (m, 3) int32
    edges : ndarray, (l, 2) int32
        Loose edges.
    attributes : dict of dict of ndarray
        By domain ("vertex", "corner", "face", "side", "edge") and name.
    moved : ndarray, (m,) bool
        Faces that have not yet the corners of the original.
    """

    vertices: np.ndarray
    faces: np.ndarray
    edges: np.ndarray
    attributes: Attributes
    moved: np.ndarray


class Progressive:
    """A mesh as a small base and patches that lead back to it, losslessly.

    Made by `progressive` or `load_progressive`.

    Attributes
    ----------
    meta : dict
        What the writer said about the mesh: names, materials, transforms.
    damage : str
        What was wrong with a file that was loaded in part; empty where nothing was.
    """

    def __init__(self, patches: Patches, meta: dict[str, Any], damage: str = "",
                 encoded: EncodedMesh | None = None) -> None:
        self._patches = patches
        self._encoded = encoded
        self.meta = meta
        self.damage = damage

    @property
    def face_count(self) -> int:
        """Triangles of the finest level that is there."""
        return self._patches.faces.shape[1] + self._patches.extra.shape[1]

    @property
    def vertex_count(self) -> int:
        """Vertices of the finest level that is there."""
        return self._patches.vertices

    @property
    def base_faces(self) -> int:
        """Triangles of the coarsest level."""
        return int(self._patches.face_starts[0]) + self._patches.extra.shape[1]

    @property
    def batches(self) -> int:
        """Batches of splits."""
        return len(self._patches.place_starts) - 1

    @property
    def batch_faces(self) -> Ints:
        """Triangles of the base and after each batch: (batches + 1,) int64."""
        return self._patches.face_starts + self._patches.extra.shape[1]

    @property
    def table(self) -> EncodedMesh:
        """What a file's table says of the mesh, without blocks."""
        patches = self._patches
        return EncodedMesh({}, [], patches.place_starts, patches.face_starts, patches.errors)

    @property
    def batch_errors(self) -> np.ndarray:
        """Estimated deviation of the base and after each batch, in the mesh's units: (batches + 1,) float64."""
        return self._patches.errors

    @property
    def attribute_names(self) -> dict[str, list[str]]:
        """Names of the attributes by domain."""
        return {domain: list(named) for domain, named in self._patches.attributes.items() if named}

    @cached_property
    def _faces_after(self) -> Ints:
        """Faces of the splits' mesh once each place is there: (p,) int64."""
        patches = self._patches
        return int(patches.face_starts[0]) + np.cumsum(patches.opened, dtype=np.int64)

    def at(self, *, faces: int | None = None, vertices: int | None = None, error: float | None = None) -> Level:
        """Return the level with at most so many triangles or vertices, or the coarsest within an error.

        Parameters
        ----------
        faces, vertices : int
            The coarsest level where even that has more.
        error : float
            In the mesh's units, by the engine's estimate after each batch.

        Raises
        ------
        MeshError
            Not exactly one of them is given.
        """
        if sum(value is not None for value in (faces, vertices, error)) != 1:
            raise MeshError("give one of faces, vertices and error")
        patches = self._patches
        base = int(patches.place_starts[0])
        if faces is not None:
            places = int(np.searchsorted(self._faces_after, faces - patches.extra.shape[1], side="right"))
        elif vertices is not None:
            seen = patches.wedge_vertex.take(patches.wedge_starts[1:] - 1) + 1
            places = int(np.searchsorted(seen, vertices, side="right"))
        else:
            fine = np.flatnonzero(patches.errors <= error)
            places = int(patches.place_starts[fine[0] if len(fine) else -1])
        return self._level(min(max(places, base), len(patches.places)))

    def _level(self, places: int) -> Level:
        patches = self._patches
        starts = patches.wedge_starts
        wedges = int(starts[places])
        width = int(self._faces_after[places - 1]) if places else 0
        if len(patches.wedge_vertex) == len(patches.places):
            entry = patches.faces[:, :width]
        else:
            entry = starts.take(patches.faces[:, :width]) + patches.corner_wedge[:, :width]
        moved = np.zeros(patches.extra.shape[1] + width, bool)
        if wedges < len(patches.wedge_parents):
            moved[patches.extra.shape[1] :] = (entry >= wedges).any(axis=0)
            entry = _ancestors(patches.wedge_parents, wedges).take(entry)
        extra = starts.take(patches.extra) + patches.extra_wedge
        entry = np.concatenate((extra, entry), axis=1) if extra.size else entry
        count = entry.shape[1]
        rows = None
        if patches.turned.any():
            rows = side_rows(patches)[:, :count]
            entry = np.take_along_axis(entry, rows, 0)
        corners = entry if len(patches.wedge_vertex) == len(patches.places) else patches.wedge_vertex.take(entry)
        seen = int(patches.wedge_vertex[wedges - 1]) + 1 if wedges else 0
        return Level(self._positions[:seen], np.ascontiguousarray(corners.T, np.int32),
                     patches.edges.astype(np.int32), self._attributes(seen, entry, rows), moved)

    @cached_property
    def _positions(self) -> np.ndarray:
        return finest(self._patches)[0]

    def _attributes(self, vertices: int, entry: Ints, rows: Ints | None) -> Attributes:
        result: Attributes = {}
        for domain, named in self._patches.attributes.items():
            for name, array in named.items():
                if domain == "vertex":
                    values = array[:vertices]
                elif domain == "corner":
                    values = array[entry.T]
                elif domain == "edge":
                    values = array
                elif domain == "face" or rows is None:
                    values = array[: entry.shape[1]]
                else:
                    values = array[np.arange(entry.shape[1])[:, None], rows.T]
                result.setdefault(domain, {})[name] = values
        return result

    def restore(self) -> Level:
        """Return the finest level: the original; in its order of vertices and faces where the stream kept it."""
        patches = self._patches
        level = self._level(len(patches.places))
        if patches.vertex_order is None or patches.face_order is None or patches.face_turn is None:
            return level
        turn = patches.face_turn
        rows = (turn[:, None] + np.arange(3)) % 3
        if patches.turned.any():
            # the original's first corner is counted in the stored face, whose last two rows `level` has swapped
            shown = np.flatnonzero(side_rows(patches)[1] == 2)
            rows[shown] = (np.array([0, 2, 1])[turn[shown]][:, None] + np.arange(3)) % 3
        number = patches.vertex_order.astype(np.int32)
        edges = np.sort(number[level.edges], axis=1)
        orders = {"vertex": np.argsort(patches.vertex_order), "edge": np.lexsort((edges[:, 1], edges[:, 0]))}
        faces = np.argsort(patches.face_order)
        attributes: Attributes = {}
        for domain, named in level.attributes.items():
            for name, array in named.items():
                if domain in ("corner", "side"):
                    array = array[np.arange(len(array))[:, None], rows]
                attributes.setdefault(domain, {})[name] = array[orders.get(domain, faces)]
        return Level(level.vertices[orders["vertex"]], number[np.take_along_axis(level.faces, rows, 1)][faces],
                     edges[orders["edge"]], attributes, level.moved)

    def encoded(self, *, bits: int | None = None, keep_order: bool = False) -> EncodedMesh:
        """Return the mesh's blocks in a file; see `save`."""
        if self._encoded is not None:
            if bits is not None or keep_order:
                raise StreamError("a loaded stream is saved as it is: restore it and make a new one instead")
            if self.damage:
                raise StreamError("a stream that is loaded in part cannot be saved: restore it and make a new one")
            return self._encoded
        if bits is not None and not 4 <= bits <= 24:
            raise StreamError(f"bits is {bits}: give a whole number from 4 to 24 (10 to 20 are usual)")
        if bits is not None and not np.isfinite(self._patches.places).all():
            raise StreamError("a mesh with coordinates that are not finite cannot be quantised: leave bits out")
        return encode_mesh(self._patches, bits=bits, keep_order=keep_order, meta=self.meta)

    def to_bytes(self, *, bits: int | None = None, keep_order: bool = False) -> bytes:
        """Return the stream; see `save`."""
        return encode([self.encoded(bits=bits, keep_order=keep_order)], {}, [1.0])

    def save(self, path: str | os.PathLike[str], *, bits: int | None = None, keep_order: bool = False) -> int:
        """Write an .esopm file, in one step.

        Parameters
        ----------
        path
        bits : int, optional
            Quantise positions to so many bits of the longest side; lossless where it is not given.
        keep_order : bool
            Keep the order of vertices and faces and each face's first corner too.

        Returns
        -------
        int
            Bytes written.
        """
        return write_bytes(path, self.to_bytes(bits=bits, keep_order=keep_order))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> int:
    """Write a file in one step: it is there whole, or the old one is; return its size."""
    with atomic_output(path) as draft:
        draft.write_bytes(data)
    return len(data)


def _ancestors(parents: Ints, limit: int) -> Ints:
    """Return for each wedge the one below `limit` that it has become."""
    ancestor = np.arange(len(parents))
    ancestor[limit:] = parents[limit:]
    while True:  # each round halves the way
        late = ancestor[limit:]
        further = ancestor.take(late)
        if np.array_equal(further, late):
            return ancestor
        ancestor[limit:] = further


def progressive(vertices: ArrayLike, faces: ArrayLike, *,
                attributes: Mapping[str, Mapping[str, ArrayLike]] | None = None,
                edges: ArrayLike | None = None, base_faces: int | None = None, ratio: float | None = None,
                meta: dict[str, Any] | None = None, **options: Any) -> Progressive:  # noqa: ANN401
    """Make a progressive mesh: a small base, and batches of splits that lead back to every vertex and face.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Taken as float32.
    faces : array_like, (m, 3)
        Degenerate, repeated and non-manifold ones are welcome: they come back too.
    attributes : dict of dict of array_like
        By domain and name: "vertex" (n, ...), "corner" (m, 3, ...), "face" (m, ...), "side"
        (m, 3, ...), of the side from each corner to the next, and "edge" (l, ...), of loose edges.
    edges : array_like, (l, 2)
        Loose edges.
    base_faces, ratio
        Triangles of the base, or as a part of all; a 500th where neither is given.
    meta : dict
        Anything that JSON holds, to travel along: names, materials, transforms.
    **options
        Fields of `Options`: method, rings, ...

    Raises
    ------
    MeshError
        The mesh or an option is not valid.
    """
    steps = progressive_steps(vertices, faces, attributes=attributes, edges=edges, base_faces=base_faces, ratio=ratio,
                              meta=meta, **options)
    return run_to_end(steps)


def progressive_steps(vertices: ArrayLike, faces: ArrayLike, *,
                      attributes: Mapping[str, Mapping[str, ArrayLike]] | None = None, edges: ArrayLike | None = None,
                      base_faces: int | None = None, ratio: float | None = None, meta: dict[str, Any] | None = None,
                      **options: Any) -> Generator[float, None, Progressive]:  # noqa: ANN401
    """Do what `progressive` does step by step: yields progress from 0 to 1, returns the mesh; may be closed."""
    source = make_source(vertices, faces, attributes, edges)
    if base_faces is not None and ratio is not None:
        raise MeshError("give base_faces or ratio, not both")
    if ratio is not None and not 0 < ratio <= 1:
        raise MeshError(f"ratio is {ratio:g}: give a number above 0 and at most 1")
    target = max(len(source.faces) // 500, 12)
    if ratio is not None:
        target = max(round(len(source.faces) * ratio), 1)
    if base_faces is not None:
        target = max(int(base_faces), 1)
    patches = yield from make_patches(source, target, options)
    return Progressive(patches, dict(meta or {}))


def load_progressive(path: str | os.PathLike[str], *, partial: bool = False,
                     max_bytes: int | None = None) -> Progressive:
    """Read an .esopm file.

    Parameters
    ----------
    path
    partial : bool
        Of a damaged file, give what is good before the damage.
    max_bytes : int, optional
        Use no more than so many bytes of the file.

    Raises
    ------
    StreamError
        It is no such file, or damaged, or of another version.
    """
    return read_part(path, from_bytes, partial=partial, max_bytes=max_bytes)


def read_part(path: str | os.PathLike[str], read: Callable[..., Made], *, partial: bool,
              max_bytes: int | None) -> Made:
    """Read a file, or no more than so many bytes of it, with a function that takes bytes and `partial`."""
    with Path(path).open("rb") as file:
        data = file.read() if max_bytes is None else file.read(max(max_bytes, 0))
        more = bool(file.read(1))
    try:
        return read(data, partial=partial or max_bytes is not None)
    except StreamError as error:
        if more:
            raise StreamError(f"{max_bytes} bytes do not hold the coarsest level ({error}): take more") from None
        raise


def from_bytes(data: bytes, *, partial: bool = False) -> Progressive:
    """Read a stream of one mesh from memory; see `load_progressive`."""
    meshes, _, damage = decode(data, partial=partial)
    if len(meshes) != 1:
        raise StreamError(f"the stream holds {len(meshes)} meshes: read it with load_scene")
    encoded, patches = meshes[0]
    return Progressive(patches, encoded.header.get("meta", {}), damage, encoded)
