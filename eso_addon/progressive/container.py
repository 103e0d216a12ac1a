# SPDX-License-Identifier: GPL-3.0-or-later
"""The bytes of an .esopm file: magic, version, header, table of blocks; see docs/format.md."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .errors import StreamError

MAGIC = b"\x89ESOPM\r\n"
VERSION = 1
_FIXED = struct.Struct("<8sHHIII")  # magic, version, flags, bytes of header and table, their checksum
_LARGEST_HEADER = 1 << 24
_LARGEST_NUMBER = 3.5e38  # of a transform: float32, as Blender stores them
# a reader must know all of these to understand a file
FEATURES = ("wedges", "attributes", "extra-faces", "edges", "turned", "quantised")
_ROW = np.dtype([("length", "<u4"), ("checksum", "<u4"), ("places", "<u4"), ("faces", "<u4"), ("error", "<f4"),
                 ("mesh", "<u4")])
# no place can be coded in fewer bits than this many a byte allows: larger counts are damage
_PLACES_A_BYTE = 4096


@dataclass
class Container:
    """A file in its parts.

    Attributes
    ----------
    header : dict
    table : ndarray of rows (length, checksum, places, faces, error, mesh)
        The base of each mesh first, then the batches of all; places and faces of its mesh after each block.
    blocks : list of bytes
        As many of them as were there whole.
    optional : dict of bytes
        By name and mesh.
    damage : str
        Why blocks are missing, empty where none is.
    """

    header: dict[str, Any]
    table: np.ndarray
    blocks: list[bytes]
    optional: dict[tuple[str, int], bytes] = field(default_factory=dict)
    damage: str = ""


def write(container: Container) -> bytes:
    """Return the bytes of a file."""
    header = dict(container.header)
    header["optional"] = [[*key, len(data), zlib.crc32(data)] for key, data in container.optional.items()]
    text = _deflate(json.dumps(header, separators=(",", ":"), sort_keys=True).encode())
    planes = container.table.view(np.uint8).reshape(len(container.table), -1).T.tobytes()
    table = struct.pack("<I", len(container.table)) + _deflate(planes)
    checksum = zlib.crc32(text + table)
    fixed = _FIXED.pack(MAGIC, VERSION, 0, len(text), len(table), checksum)
    return b"".join([fixed, text, table, *container.blocks, *container.optional.values()])


def make_table(blocks: list[bytes], places: np.ndarray, faces: np.ndarray, errors: np.ndarray,
               meshes: np.ndarray) -> np.ndarray:
    """Return the table of some blocks."""
    table = np.zeros(len(blocks), _ROW)
    table["length"] = [len(block) for block in blocks]
    table["checksum"] = [zlib.crc32(block) for block in blocks]
    table["places"], table["faces"], table["error"], table["mesh"] = places, faces, errors, meshes
    return table


def read(data: bytes, *, partial: bool) -> Container:
    """Take a file apart and check every part.

    Parameters
    ----------
    data : bytes
    partial : bool
        Keep the good blocks before the first damaged one.

    Raises
    ------
    StreamError
        It is not such a file, of another version, asks for what is not known, or is damaged.
    """
    if len(data) < _FIXED.size:
        raise StreamError("this is not an .esopm file, or its beginning is missing")
    magic, version, flags, header_size, table_size, checksum = _FIXED.unpack_from(data)
    if magic != MAGIC:
        raise StreamError("this is not an .esopm file: its first bytes are others")
    if version != VERSION or flags:
        raise StreamError(f"the file has version {version}.{flags}: this reader knows version {VERSION}.0; update it")
    begin = _FIXED.size
    text, table_bytes = data[begin : begin + header_size], data[begin + header_size : begin + header_size + table_size]
    if len(text) < header_size or len(table_bytes) < table_size or zlib.crc32(text + table_bytes) != checksum:
        raise StreamError("the header of the stream is damaged: fetch the file again")
    header = _header(text)
    table = _table(table_bytes, len(header["meshes"]))
    position = begin + header_size + table_size
    container = Container(header, table, [])
    if table["length"].astype(np.int64).sum() * _PLACES_A_BYTE + 4096 < int(table["places"].max()):
        raise StreamError("the stream's counts are larger than it can hold: fetch the file again")
    for number, row in enumerate(table):
        block = data[position : position + int(row["length"])]
        if len(block) < row["length"] or zlib.crc32(block) != row["checksum"]:
            what = "is cut short" if len(block) < row["length"] else "is damaged"
            container.damage = f"the stream {what} at block {number} of {len(table)}: fetch the file again"
            break
        container.blocks.append(block)
        position += len(block)
    if container.damage:
        if not partial or len(container.blocks) < len(header["meshes"]):
            raise StreamError(container.damage + ("" if partial else ", or ask for what is whole of it (partial)"))
        return container
    return _optional(container, data, position, partial)


def base_bytes(data: bytes) -> int:
    """Return how many of a file's first bytes hold the bases of all meshes: from there on something can be shown."""
    _, _, _, header_size, table_size, _ = _FIXED.unpack_from(data)
    begin = _FIXED.size + header_size
    meshes = len(_header(data[_FIXED.size : begin])["meshes"])
    table = _table(data[begin : begin + table_size], meshes)
    return begin + table_size + int(table["length"][:meshes].sum())


def _optional(container: Container, data: bytes, position: int, partial: bool) -> Container:
    for name, mesh, length, checksum in container.header["optional"]:
        block = data[position : position + length]
        position += length
        if len(block) < length or zlib.crc32(block) != checksum:
            container.damage = f"the stream's {name} is damaged or missing: fetch the file again"
            if not partial:
                raise StreamError(container.damage + ", or ask for what is whole of it (partial)")
            return container
        container.optional[name, mesh] = block
    if position < len(data):
        container.damage = "the stream is followed by bytes that do not belong to it: fetch the file again"
        if not partial:
            raise StreamError(container.damage)
    return container


def _deflate(data: bytes) -> bytes:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def inflate(data: bytes, limit: int) -> bytes:
    """Unpack at most so many bytes."""
    unpacker = zlib.decompressobj(-15)
    try:
        raw = unpacker.decompress(data, limit + 1)
    except zlib.error:
        raise StreamError("the stream is damaged: a block cannot be unpacked; fetch the file again") from None
    if len(raw) > limit or not unpacker.eof:
        raise StreamError("the stream is damaged: a block is larger than it says; fetch the file again")
    return raw


def _header(text: bytes) -> dict[str, Any]:
    try:
        header = json.loads(inflate(text, _LARGEST_HEADER))
        unknown = set().union(*(_check_entry(entry) for entry in header["meshes"]))
        if not header["meshes"]:
            raise TypeError
        _check_objects(header.get("meta", {}), len(header["meshes"]))
        for name, mesh, length, checksum in header["optional"]:
            if not (isinstance(name, str) and all(type(number) is int for number in (mesh, length, checksum))
                    and length >= 0):
                raise TypeError
    except (ValueError, KeyError, TypeError, RecursionError, AttributeError) as error:
        if isinstance(error, StreamError):
            raise
        raise StreamError("the header of the stream says nothing sensible: fetch the file again") from None
    if unknown:
        names = ", ".join(sorted(map(str, unknown)))[:100]
        raise StreamError(f"the stream needs what this reader does not know ({names}): update it")
    return header


def is_transform(matrix: Sequence[float]) -> bool:
    """Tell whether these are the numbers of an object's place."""
    return len(matrix) == 16 and all(abs(number) <= _LARGEST_NUMBER for number in matrix)


def _check_objects(meta: dict[str, Any], meshes: int) -> None:
    for entry in meta.get("objects", []):
        if not (isinstance(entry["name"], str) and type(entry["mesh"]) is int and 0 <= entry["mesh"] < meshes):
            raise TypeError
        if not is_transform(entry["matrix"]):
            raise ValueError


def _check_entry(entry: dict[str, Any]) -> set:
    """Check a mesh's entry of the header; return what it needs and is not known."""
    for name, kind in (("places", int), ("faces", int), ("extra", int), ("edges", int), ("vertices", int),
                       ("wedges", int), ("lanes", int), ("grid", list), ("attributes", list), ("hash", str)):
        if type(entry[name]) is not kind or (kind is int and not 0 <= entry[name] < 1 << 31):
            raise TypeError
    if not isinstance(entry.get("meta", {}), dict):
        raise TypeError
    return set(entry["needs"]) - set(FEATURES)


def _table(data: bytes, meshes: int) -> np.ndarray:
    if len(data) < 4:
        raise StreamError("the table of the stream is damaged: fetch the file again")
    (rows,) = struct.unpack_from("<I", data)
    if not 1 <= rows <= 1 << 20:
        raise StreamError("the table of the stream is damaged: fetch the file again")
    raw = inflate(data[4:], rows * _ROW.itemsize)
    if len(raw) != rows * _ROW.itemsize:
        raise StreamError("the table of the stream is damaged: fetch the file again")
    table = np.ascontiguousarray(np.frombuffer(raw, np.uint8).reshape(-1, rows).T).view(_ROW).ravel()
    order = np.argsort(table["mesh"], kind="stable")
    change = np.diff(table["mesh"][order].astype(np.int64))
    wrong = not np.array_equal(table["mesh"][:meshes], np.arange(meshes)) or int(table["mesh"].max()) >= meshes
    for name in ("places", "faces"):
        wrong |= bool(((np.diff(table[name][order].astype(np.int64)) < 0) & (change == 0)).any())
    if wrong:
        raise StreamError("the table of the stream is damaged: fetch the file again")
    return table
