# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of one mesh to the blocks of a stream, and back, batch by batch."""

from __future__ import annotations

import math
import operator
import re
import struct
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..core.mesh import Ints
from . import rans
from .batch_codec import Connectivity, Done, Mesh, Splits, code_batch
from .coder import Reader, Writer
from .columns import ColumnReader, ColumnWriter, as_words, from_words
from .errors import StreamError
from .finest import digest
from .geometry import Grid, Shape, lossless_grid, quantised_grid
from .patches import Patches
from .source import DOMAINS

_DTYPE = re.compile("[<|][biuf][1248]")
_BLOCK = struct.Struct("<II")  # bytes of symbols, of plain bits; columns fill the rest


class _Codec:
    """The state that writer and reader share, block after block."""

    def __init__(self, header: dict[str, Any], table_places: Ints, table_faces: Ints, patches: Patches,
                 numbers: Ints, grid: Grid, reading: bool) -> None:
        self.header, self.patches, self.reading = header, patches, reading
        self.table_places, self.table_faces = table_places, table_faces
        count, width = int(table_places[-1]), int(table_faces[-1])
        self.mesh = Mesh(grid, count, width)
        self.numbers = numbers
        self.connectivity, self.shape = Connectivity(), Shape()
        self.wedged = "wedges" in header["needs"]
        self.turned = "turned" in header["needs"]
        self.vertex_seen = 0
        self.words: dict[str, list[tuple[str, Ints, int]]] = {}
        self.base_faces = self.state_wedge = np.zeros((3, width), np.int64)

    # -- base ---------------------------------------------------------------------------------------------------

    def base(self, block: ColumnWriter | ColumnReader) -> None:
        """Code the base: places, faces, faces beside the splits, loose edges, attributes."""
        mesh, patches, known = self.mesh, self.patches, not self.reading
        count, width = int(self.table_places[0]), int(self.table_faces[0])
        columns = self.numbers[:, :count] & 0xFFFFFFFF if known else [None] * 3
        values = np.stack([_running(block, 4, column, count) for column in columns])
        values = np.where(values >> 31, values - (1 << 32), values)
        _check_numbers(mesh.grid, values)
        mesh.place(values)
        faces = np.zeros((3, 0), np.int64)
        if known:
            faces = self.base_faces
        mesh.faces[:, :width] = _code_faces(block, faces if known else None, width, count)
        mesh.face_count = width
        mesh.parents[:count] = -1
        mesh.degree[:count] = np.bincount(mesh.faces[:, :width].ravel(), minlength=count)
        extra = self.header["extra"]
        patches.extra = _code_faces(block, patches.extra if known else None, extra, count)
        self._places_wedges(block, 0, count)
        self._corner_wedges(block, np.concatenate((patches.extra, mesh.faces[:, :width]), axis=1), 0, 0, extra + width)
        self._faces(block, np.full(extra + width, -1), 0)
        edges = patches.edges.T if known else None
        ends = int(patches.wedge_vertex[: int(patches.wedge_starts[count])].max(initial=-1)) + 1
        patches.edges = _code_edges(block, edges, self.header["edges"], ends).T
        self._values(block, "edge", 0, self.header["edges"], np.zeros(0, np.int64))

    # -- batches ------------------------------------------------------------------------------------------------

    def batch(self, coder: Writer | Reader, block: ColumnWriter | ColumnReader, splits: Splits | None) -> Done:
        """Code one batch."""
        mesh = self.mesh
        places, faces = mesh.vertex_count, mesh.face_count
        done = code_batch(coder, self.connectivity, self.shape, mesh, splits)
        if self.reading:
            self.patches.opened[places : mesh.vertex_count] = done.there.sum(axis=0)
        if self.columns or self.reading:
            self._places_wedges(block, places, mesh.vertex_count)
            self._moved_wedges(block, done, faces)
            beside = np.repeat(done.start % max(faces, 1), done.there.sum(axis=0))
            self._faces(block, self.header["extra"] + beside, self.header["extra"] + faces)
        return done

    @property
    def columns(self) -> bool:
        """Whether batches carry columns at all."""
        return self.wedged or self.turned or bool(self.header["attributes"])

    def _places_wedges(self, block: ColumnWriter | ColumnReader, first: int, last: int) -> None:
        """Code the wedges of new places, and the attributes of their vertices and wedges."""
        patches, count = self.patches, last - first
        known = not self.reading
        if self.wedged:
            counts = np.diff(patches.wedge_starts[first : last + 1]) if known else None
            counts = block.column(4, np.ones(count, np.int64), counts, count)
            if self.reading:
                if (counts < 1).any() or counts.sum() + patches.wedge_starts[first] > self.header["wedges"]:
                    raise StreamError("the stream is damaged: more wedges than its header says; fetch the file again")
                patches.wedge_starts[first + 1 : last + 1] = patches.wedge_starts[first] + np.cumsum(counts)
        elif self.reading:
            patches.wedge_starts[first + 1 : last + 1] = np.arange(first + 1, last + 1)
        begin, end = int(patches.wedge_starts[first]), int(patches.wedge_starts[last])
        place = np.repeat(np.arange(first, last), np.diff(patches.wedge_starts[first : last + 1]))
        inner = patches.wedge_starts.take(place) != np.arange(begin, end)
        self._wedge_parents(block, begin, end, place)
        self._wedge_vertices(block, begin, end, inner)
        vertices = np.flatnonzero(np.diff(patches.wedge_vertex[begin:end], prepend=self.vertex_seen - 1)) + begin
        # a value is expected to be that of the wedge it merges into, and another wedge's that of the one before
        source = np.where(patches.wedge_parents[begin:end] < 0, np.arange(begin, end) - 1,
                          patches.wedge_parents[begin:end])
        self._values(block, "corner", begin, end, source)
        seen = self.vertex_seen
        self.vertex_seen += len(vertices)
        if self.reading and self.vertex_seen > self.header["vertices"]:
            raise StreamError("the stream is damaged: more vertices than its header says; fetch the file again")
        at = source.take(vertices - begin)
        self._values(block, "vertex", seen, self.vertex_seen, np.where(at < 0, -1, patches.wedge_vertex.take(at)))

    def _wedge_parents(self, block: ColumnWriter | ColumnReader, begin: int, end: int, place: Ints) -> None:
        patches = self.patches
        parent = self.mesh.parents.take(place)
        new = parent >= 0
        first = patches.wedge_starts.take(parent.clip(min=0))
        if self.reading:
            patches.wedge_parents[begin:end] = np.where(new, first, -1)
        if not self.wedged:
            return
        several = np.flatnonzero(new & (patches.wedge_starts.take(parent + 1) - first > 1))
        known = None if self.reading else patches.wedge_parents[begin:end][several] - first[several]
        local = block.column(4, np.zeros(len(several), np.int64), known, len(several))
        if self.reading:
            limit = patches.wedge_starts.take(parent[several] + 1) - first[several]
            if (local >= limit).any():
                raise StreamError("the stream is damaged: a wedge joins none that is there; fetch the file again")
            patches.wedge_parents[begin:end][several] += local

    def _wedge_vertices(self, block: ColumnWriter | ColumnReader, begin: int, end: int, inner: np.ndarray) -> None:
        patches = self.patches
        at = np.flatnonzero(inner)
        fresh = np.ones(end - begin, np.int64)
        if self.wedged:
            known = None
            if not self.reading:
                known = np.diff(patches.wedge_vertex[begin:end], prepend=self.vertex_seen - 1).take(at)
            fresh[at] = block.column(1, np.ones(len(at), np.int64), known, len(at)) & 1
        if self.reading:
            patches.wedge_vertex[begin:end] = self.vertex_seen - 1 + np.cumsum(fresh)

    def _moved_wedges(self, block: ColumnWriter | ColumnReader, done: Done, faces_before: int) -> None:
        """Code the wedges of corners that changed vertex and of new faces."""
        if not self.wedged:
            return
        mesh, patches = self.mesh, self.patches
        rows, faces = done.slot // max(faces_before, 1), done.slot % max(faces_before, 1)
        new = np.arange(faces_before, mesh.face_count)
        rows = np.concatenate((rows, np.tile(np.arange(3), len(new))))
        faces = np.concatenate((faces, np.repeat(new, 3)))
        self._code_wedges(block, mesh.faces, self.state_wedge, rows, faces, patches.wedge_starts)

    def _corner_wedges(self, block: ColumnWriter | ColumnReader, corners: Ints, first: int, last: int,
                       count: int) -> None:
        """Code the wedges of the base's corners, faces beside the splits first."""
        extra = self.header["extra"]
        whole = np.zeros((3, count), np.int64)
        if not self.reading:
            whole = np.concatenate((self.patches.extra_wedge, self.state_wedge[:, : count - extra]), axis=1)
        if self.wedged:
            rows, faces = np.tile(np.arange(3), count), np.repeat(np.arange(count), 3)
            self._code_wedges(block, corners, whole, rows, faces, self.patches.wedge_starts)
        self.patches.extra_wedge = whole[:, :extra]
        self.state_wedge[:, : count - extra] = whole[:, extra:]

    def _code_wedges(self, block: ColumnWriter | ColumnReader, corners: Ints, wedges: Ints, rows: Ints, faces: Ints,
                     starts: Ints) -> None:
        place = corners[rows, faces]
        size = starts.take(place + 1) - starts.take(place)
        several = np.flatnonzero(size > 1)
        if self.reading:
            wedges[rows, faces] = 0
        rows, faces = rows.take(several), faces.take(several)
        known = None if self.reading else self.final_wedge(corners, wedges, rows, faces)
        width = 1 if int(size.max(initial=1)) <= 256 else 4
        found = block.column(width, np.zeros(len(several), np.int64), known, len(several))
        if self.reading and (found >= size.take(several)).any():
            raise StreamError("the stream is damaged: a corner has no such wedge; fetch the file again")
        wedges[rows, faces] = found

    def final_wedge(self, corners: Ints, wedges: Ints, rows: Ints, faces: Ints) -> Ints:
        """Return the known wedges of some corners (writing only)."""
        if corners is not self.mesh.faces:
            return wedges[rows, faces]
        patches, starts = self.patches, self.patches.wedge_starts
        entry = starts.take(patches.faces[rows, faces]) + patches.corner_wedge[rows, faces]
        limit = starts[self.mesh.vertex_count]
        while True:  # the wedge that it has become by now
            late = np.flatnonzero(entry >= limit)
            if len(late) == 0:
                break
            entry[late] = patches.wedge_parents.take(entry.take(late))
        return entry - starts.take(corners[rows, faces])

    def _faces(self, block: ColumnWriter | ColumnReader, beside: Ints, first: int) -> None:
        """Code the attributes of new faces; expected is the value of the face that an arc starts in."""
        last = first + len(beside)
        beside = np.where(beside < 0, np.arange(first, last) - 1, beside)
        self._values(block, "face", first, last, beside)
        self._values(block, "side", first, last, beside)
        if self.turned:
            extra = self.header["extra"]
            own = slice(max(first - extra, 0), max(last - extra, 0))
            size = own.stop - own.start
            known = None if self.reading else self.patches.turned[own].astype(np.int64)
            values = block.column(1, np.zeros(size, np.int64), known, size)
            self.patches.turned[own] = values & 1

    def _values(self, block: ColumnWriter | ColumnReader, domain: str, first: int, last: int, source: Ints) -> None:
        if first == last:  # else damage could ask for millions of columns that hold nothing
            return
        for _, words, width in self.words.get(domain, ()):
            for column in words.T:
                if first == 0:
                    known = None if self.reading else column[:last]
                    column[:last] = _running(block, width, known, last)
                    continue
                # what is in the block itself is not known yet
                expected = column.take(np.where((source >= 0) & (source < first), source, 0))
                known = None if self.reading else column[first:last]
                column[first:last] = block.column(width, expected, known, last - first)


def _running(block: ColumnWriter | ColumnReader, width: int, known: Ints | None, count: int) -> Ints:
    """Code a column by differences from the row before."""
    bits = 8 * width
    mask = (1 << bits) - 1
    if known is not None:
        before = np.concatenate(([0], known[:-1])) if count else known
        block.column(width, before, known, count)
        return known
    steps = block.column(width, np.zeros(count, np.int64), None, count)
    return np.cumsum(steps) & mask


def _code_faces(block: ColumnWriter | ColumnReader, known: Ints | None, count: int, places: int) -> Ints:
    """Code faces: the first corner against the face before, the others against the first."""
    first = _running(block, 4, None if known is None else known[0], count)
    rows = [first] + [block.column(4, first, None if known is None else known[row], count) for row in (1, 2)]
    faces = np.stack(rows)
    if faces.size and int(faces.max()) >= places:
        raise StreamError("the stream is damaged: a face names a vertex that is not there; fetch the file again")
    return faces


def _code_edges(block: ColumnWriter | ColumnReader, known: Ints | None, count: int, vertices: int) -> Ints:
    first = _running(block, 4, None if known is None else known[0], count)
    edges = np.stack((first, block.column(4, first, None if known is None else known[1], count)))
    if edges.size and int(edges.max()) >= vertices:
        raise StreamError("the stream is damaged: an edge names a vertex that is not there; fetch the file again")
    return edges


def _check_numbers(grid: Grid, numbers: Ints) -> None:
    if grid.kind != 2 and numbers.size and int(np.abs(numbers).max()) >= 1 << 27:
        raise StreamError("the stream is damaged: a coordinate is off its grid; fetch the file again")


@dataclass
class EncodedMesh:
    """One mesh of a file.

    Attributes
    ----------
    header : dict
        Its entry in the file's header.
    blocks : list of bytes
        Base, then batches; as many of them as are there.
    places, faces, errors : ndarray, (1 + batches,)
        After each block; of all blocks, even if some are missing.
    optional : dict of bytes
    """

    header: dict[str, Any]
    blocks: list[bytes]
    places: Ints
    faces: Ints
    errors: np.ndarray
    optional: dict[str, bytes] = field(default_factory=dict)


def encode_mesh(patches: Patches, *, bits: int | None, keep_order: bool, meta: dict[str, Any]) -> EncodedMesh:
    """Return the blocks of a mesh."""
    if bits is None:
        grid, numbers = lossless_grid(patches.places)
    else:
        grid, numbers = quantised_grid(patches.places, bits)
        patches = replace(patches, places=grid.floats(numbers))
    patches = replace(patches)
    numbers = np.ascontiguousarray(numbers.T)
    header = _header(patches, grid, bits, meta)
    codec = _Codec(header, patches.place_starts, patches.face_starts, patches, numbers, grid, False)
    codec.words = {domain: [(name, *as_words(array)) for name, array in patches.attributes.get(domain, {}).items()]
                   for domain in DOMAINS}
    codec.base_faces = _faces_at_base(patches)
    codec.state_wedge = _wedges_at_base(patches, codec.wedged)
    block = ColumnWriter()
    codec.base(block)
    base = block.finish()
    parts, runs = [], []
    for splits in patches.batches:
        first = codec.mesh.vertex_count
        writer, block = Writer(), ColumnWriter()
        codec.batch(writer, block, replace(splits, numbers=numbers[:, first : first + len(splits.vertex)]))
        runs.append(writer.runs)
        parts.append((writer.plain(), block.finish()))
    states, words = rans.encode(runs, header["lanes"])
    blocks = [base + states] + [_BLOCK.pack(len(symbols), len(plain)) + symbols + plain + columns
                                for symbols, (plain, columns) in zip(words, parts, strict=True)]
    optional = {"order": _order_block(patches)} if keep_order else {}
    return EncodedMesh(header, blocks, patches.place_starts, patches.face_starts, patches.errors, optional)


def _header(patches: Patches, grid: Grid, bits: int | None, meta: dict[str, Any]) -> dict[str, Any]:
    several = len(patches.wedge_vertex) > len(patches.places)
    attributes = [[domain, name, array.dtype.str, list(array.shape[2:] if domain == "side" else array.shape[1:])]
                  for domain in DOMAINS for name, array in patches.attributes.get(domain, {}).items()]
    needs = [name for name, there in (("wedges", several), ("attributes", bool(attributes)),
                                      ("extra-faces", patches.extra.size > 0), ("edges", len(patches.edges) > 0),
                                      ("turned", bool(patches.turned.any())), ("quantised", bits is not None)) if there]
    header: dict[str, Any] = {
        "places": len(patches.places), "faces": patches.faces.shape[1], "extra": patches.extra.shape[1],
        "edges": len(patches.edges), "vertices": patches.vertices, "wedges": len(patches.wedge_vertex),
        "grid": [grid.kind, grid.scale, *grid.origin, grid.shift], "needs": needs,
        "attributes": attributes, "hash": digest(patches), "meta": meta,
        "lanes": rans.lanes_for(len(patches.places))}
    if bits is not None:
        header["bits"] = bits
    return header


def _faces_at_base(patches: Patches) -> Ints:
    faces = patches.faces[:, : patches.face_starts[0]].copy()
    limit = patches.place_starts[0]
    while True:
        late = faces >= limit
        if not late.any():
            return faces
        faces[late] = patches.parents[faces[late]]


def _wedges_at_base(patches: Patches, several: bool) -> Ints:
    wedges = np.zeros_like(patches.faces)
    width = patches.face_starts[0]
    if not several:
        return wedges
    starts, limit = patches.wedge_starts, patches.wedge_starts[patches.place_starts[0]]
    entry = starts.take(patches.faces[:, :width]) + patches.corner_wedge[:, :width]
    place = patches.faces[:, :width].copy()
    while True:
        late = entry >= limit
        if not late.any():
            break
        entry[late] = patches.wedge_parents[entry[late]]
        place[late] = patches.parents[place[late]]
    wedges[:, :width] = entry - starts.take(place)
    return wedges


def _order_block(patches: Patches) -> bytes:
    assert patches.vertex_order is not None
    assert patches.face_order is not None
    assert patches.face_turn is not None
    block = ColumnWriter()
    _running(block, 4, patches.vertex_order, len(patches.vertex_order))
    _running(block, 4, patches.face_order, len(patches.face_order))
    block.column(1, np.zeros(len(patches.face_turn), np.int64), patches.face_turn, len(patches.face_turn))
    return block.finish()


def decode_mesh(mesh: EncodedMesh) -> Patches:
    """Return the patches of a mesh, from as many of its blocks as are there."""
    header, given = mesh.header, len(mesh.blocks)
    if mesh.places[-1] != header["places"] or mesh.faces[-1] != header["faces"]:
        raise StreamError("the stream's table and header differ: fetch the file again")
    # no element takes less than this part of a byte: larger counts are damage
    limit = 4096 * (sum(map(len, mesh.blocks)) + 64)
    places, faces = mesh.places[:given], mesh.faces[:given]
    if max(header["extra"], header["edges"], int(places[-1]), int(faces[-1]) // 2) > limit:
        raise StreamError("the stream's counts are larger than it can hold: fetch the file again")
    # what is there of a stream that is cut short has no more of these either
    header = {**header, "wedges": min(header["wedges"], limit), "vertices": min(header["vertices"], limit)}
    patches = _empty_patches(header, places, faces, mesh.errors[:given])
    codec = _Codec(header, places, faces, patches, np.zeros((3, 0), np.int64), _grid(header["grid"]), True)
    descriptors = _descriptors(header)
    _prepare_words(codec, descriptors, limit)
    states = 4 * header["lanes"]
    if not 0 < states <= len(mesh.blocks[0]):
        raise StreamError("the header of the stream says nothing sensible: fetch the file again")
    codec.base(ColumnReader(mesh.blocks[0][:-states]))
    symbols = rans.RansReader(mesh.blocks[0][-states:])
    for number in range(1, given):
        _read_batch(codec, symbols, mesh.blocks[number])
        if codec.mesh.vertex_count != places[number] or codec.mesh.face_count != faces[number]:
            raise StreamError("the stream is damaged: a batch holds other counts than its table; fetch the file again")
    _finish(patches, codec, descriptors, given)
    if given == len(mesh.places):
        if "order" in mesh.optional:
            _read_order(patches, mesh.optional["order"])
        if patches.vertices != header["vertices"] or digest(patches) != header["hash"]:
            raise StreamError("the restored mesh is not the one that was written: fetch the file again")
    return patches


def _empty_patches(header: dict[str, Any], places: Ints, faces: Ints, errors: np.ndarray) -> Patches:
    count, width = int(places[-1]), int(faces[-1])
    wedges = header["wedges"] if "wedges" in header["needs"] else count
    none, no_faces = np.zeros(0, np.int64), np.zeros((3, 0), np.int64)
    return Patches(np.zeros((0, 3), np.float32), none, no_faces, [], places, faces, no_faces,
                   np.zeros(count + 1, np.int64), np.zeros(wedges, np.int64), np.zeros(wedges, np.int64), no_faces,
                   no_faces, np.zeros(width, np.uint8), np.zeros((0, 2), np.int64), {}, None, None, None, errors,
                   np.zeros(count, np.uint8))


def _prepare_words(codec: _Codec, descriptors: list[tuple], limit: int) -> None:
    """Make room for the attributes' values."""
    header = codec.header
    faces = header["extra"] + int(codec.table_faces[-1])
    sizes = {"vertex": header["vertices"], "corner": len(codec.patches.wedge_parents), "face": faces, "side": faces,
             "edge": header["edges"]}
    room = 0
    for domain, name, dtype, shape in descriptors:
        items = math.prod(shape) * (3 if domain == "side" else 1) * max(dtype.itemsize // 4, 1)
        room += items * max(sizes[domain], 1)
        if room > limit:
            raise StreamError("the stream's counts are larger than it can hold: fetch the file again")
        words = np.zeros((sizes[domain], items), np.int64)
        codec.words.setdefault(domain, []).append((name, words, min(dtype.itemsize, 4)))


def _read_batch(codec: _Codec, reader: rans.RansReader, data: bytes) -> None:
    if len(data) < _BLOCK.size:
        raise StreamError("the stream is damaged: a batch is too short; fetch the file again")
    symbols, plain = _BLOCK.unpack_from(data)
    begin = _BLOCK.size
    if begin + symbols + plain > len(data) or plain % 4 or symbols % 2:
        raise StreamError("the stream is damaged: a batch's parts do not fit; fetch the file again")
    reader.feed(data[begin : begin + symbols])
    coder = Reader(reader, data[begin + symbols : begin + symbols + plain])
    codec.batch(coder, ColumnReader(data[begin + symbols + plain :]), None)


def _finish(patches: Patches, codec: _Codec, descriptors: list[tuple], given: int) -> None:
    mesh = codec.mesh
    patches.places = np.ascontiguousarray(mesh.grid.floats(mesh.numbers[:, : mesh.vertex_count].T))
    patches.parents = mesh.parents[: mesh.vertex_count]
    patches.faces = mesh.faces[:, : mesh.face_count]
    patches.corner_wedge = codec.state_wedge[:, : mesh.face_count]
    wedges = int(patches.wedge_starts[-1])
    patches.wedge_parents, patches.wedge_vertex = patches.wedge_parents[:wedges], patches.wedge_vertex[:wedges]
    sizes = {"vertex": codec.vertex_seen, "corner": wedges, "edge": codec.header["edges"]}
    faces = patches.extra.shape[1] + mesh.face_count
    place = dict.fromkeys(DOMAINS, 0)
    for domain, name, dtype, shape in descriptors:
        _, words, _ = codec.words[domain][place[domain]]
        place[domain] += 1
        rows = words[: sizes.get(domain, faces)]
        whole = (3, *shape) if domain == "side" else shape
        patches.attributes.setdefault(domain, {})[name] = from_words(rows, dtype, whole)


def _read_order(patches: Patches, data: bytes) -> None:
    block = ColumnReader(data)
    vertices, faces = patches.vertices, patches.extra.shape[1] + patches.faces.shape[1]
    order = _running(block, 4, None, vertices), _running(block, 4, None, faces)
    for numbers in order:
        if not np.array_equal(np.sort(numbers), np.arange(len(numbers))):
            raise StreamError("the stream is damaged: its order leaves something out; fetch the file again")
    patches.vertex_order, patches.face_order = order
    patches.face_turn = block.column(1, np.zeros(faces, np.int64), None, faces) % 3


def _grid(values: list) -> Grid:
    try:
        kind, scale, x, y, z, shift = values
        grid = Grid(int(kind), float(scale), (float(x), float(y), float(z)), int(shift))
    except (ValueError, TypeError, OverflowError):
        raise StreamError("the header of the stream says nothing sensible: fetch the file again") from None
    if not (0 <= grid.kind <= 2 and np.isfinite([grid.scale, *grid.origin]).all() and grid.scale > 0
            and 0 <= grid.shift < 40):
        raise StreamError("the header of the stream says nothing sensible: fetch the file again")
    return grid


def _descriptors(header: dict[str, Any]) -> list[tuple]:
    result = []
    try:
        for domain, name, dtype, shape in header["attributes"]:
            if domain not in DOMAINS or not _DTYPE.fullmatch(dtype) or not isinstance(name, str):
                raise ValueError
            if len(shape) > 1 or min(shape, default=0) < 0:
                raise ValueError
            result.append((domain, name, np.dtype(dtype), tuple(operator.index(size) for size in shape)))
    except (ValueError, TypeError, OverflowError):
        raise StreamError("the header of the stream says nothing sensible: fetch the file again") from None
    return result
