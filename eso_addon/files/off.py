# SPDX-License-Identifier: GPL-3.0-or-later
"""The Object File Format (.off): triangles and polygons as text."""

import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .atomic import atomic_output

_HEADER = re.compile(rb"(?:ST)?C?N?(4?n?)OFF\b[ \t\r]*(BINARY)?", re.IGNORECASE)


class FileFormatError(ValueError):
    """A file that cannot be read, told in one line."""


def read_off(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read a text .off file, with any of the prefixes ST, C and N, comments, and polygons of any size.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    vertices : (n, 3) float64
        Positions; colours, normals and texture coordinates are left behind.
    faces : (m, 3) int64
        Triangles. A polygon becomes a fan from its first corner; points and edges are dropped.

    Raises
    ------
    FileFormatError
        If the file is no text .off file, is cut short, or names a vertex that it does not have.
    OSError
        If the file cannot be opened.
    """
    name = Path(path).name
    body, counts = _split_header(_without_comments(Path(path).read_bytes().removeprefix(b"\xef\xbb\xbf")), name)
    line_starts, tokens = _tokens(body, name)
    vertex_count, face_count = counts
    if len(line_starts) >= vertex_count + face_count:
        face_starts = line_starts[vertex_count : vertex_count + face_count]
        vertices = _vertices(tokens[: _end(line_starts, vertex_count, len(tokens))], vertex_count, name)
    else:
        face_starts = _starts_without_lines(tokens, vertex_count, face_count, name)
        vertices = _vertices(tokens[: 3 * vertex_count], vertex_count, name)
    return vertices, _fans(tokens, face_starts, vertex_count, name)


def write_off(path: str | os.PathLike[str], vertices: ArrayLike, faces: ArrayLike) -> None:
    """Write triangles as a text .off file that reads back bit for bit.

    Parameters
    ----------
    path
        The file; it appears whole or not at all.
    vertices
        (n, 3) positions.
    faces
        (m, 3) vertex indices.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    positions = np.asarray(vertices, dtype=np.float64)
    corners = np.asarray(faces, dtype=np.int64)
    with atomic_output(path) as draft, open(draft, "w", encoding="ascii", newline="\n") as file:
        file.write(f"OFF\n{len(positions)} {len(corners)} 0\n")
        file.write("%r %r %r\n" * len(positions) % tuple(positions.ravel().tolist()))
        file.write("3 %d %d %d\n" * len(corners) % tuple(corners.ravel().tolist()))


def _without_comments(data: bytes) -> bytes:
    """Drop everything from # to the end of a line."""
    return re.sub(rb"#[^\n]*", b"", data).replace(b"\r", b"\n").strip() if b"#" in data else data.strip()


def _split_header(data: bytes, name: str) -> tuple[bytes, tuple[int, int]]:
    """Read the keyword and the counts of vertices and faces; give what follows."""
    header = _HEADER.match(data)
    if header and header.group(2):
        raise FileFormatError(f"{name} is a binary .off file; save it as text")
    if header and header.group(1):
        raise FileFormatError(f"{name} is not a mesh in three dimensions")
    counts = re.compile(rb"\s*(\d+)\s+(\d+)(?:[ \t]+\d+)?[ \t\r]*(?:\n|$)").match(data, header.end() if header else 0)
    if counts is None:
        raise FileFormatError(f"{name} is no .off file: it does not begin with OFF and the counts of its elements")
    return data[counts.end() :], (int(counts.group(1)), int(counts.group(2)))


def _tokens(body: bytes, name: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Give all numbers, and the index of the first number of each line that has any."""
    characters = np.frombuffer(body, dtype=np.uint8)
    is_ink = characters > ord(" ")
    starts = np.flatnonzero(is_ink & ~np.concatenate(([False], is_ink[:-1])))
    numbers = np.array(body.split(), dtype="S")
    try:
        tokens = numbers.astype(np.float64)
    except ValueError as error:
        raise FileFormatError(f"{name} holds something that is no number: {error}") from None
    line_of_token = np.cumsum(characters == ord("\n"))[starts]
    line_starts = np.flatnonzero(np.diff(line_of_token, prepend=-1))
    return line_starts, tokens


def _end(line_starts: NDArray[np.int64], line: int, token_count: int) -> int:
    """Give the index of the first number of a line, or the end."""
    return int(line_starts[line]) if line < len(line_starts) else token_count


def _vertices(tokens: NDArray[np.float64], count: int, name: str) -> NDArray[np.float64]:
    """Cut the numbers into vertices, and each to its position."""
    if count == 0:
        return np.zeros((0, 3))
    if len(tokens) % count or len(tokens) < 3 * count:
        raise FileFormatError(f"{name} is damaged: its vertices do not all have the same number of coordinates")
    return np.ascontiguousarray(tokens.reshape(count, -1)[:, :3])


def _starts_without_lines(
    tokens: NDArray[np.float64], vertex_count: int, face_count: int, name: str
) -> NDArray[np.int64]:
    """Find the faces in a file that is not laid out by lines: bare positions, then faces of one size."""
    first = 3 * vertex_count
    size = int(tokens[first]) + 1 if len(tokens) > first and np.isfinite(tokens[first]) else 0
    if size < 1 or len(tokens) != first + size * face_count:
        raise FileFormatError(f"{name} is cut short: it promises {vertex_count} vertices and {face_count} faces")
    return first + size * np.arange(face_count)


def _fans(
    tokens: NDArray[np.float64], starts: NDArray[np.int64], vertex_count: int, name: str
) -> NDArray[np.int64]:
    """Turn polygons into triangles around their first corners."""
    sizes = tokens[starts]
    lengths = np.diff(starts, append=len(tokens))
    if not np.all((sizes >= 0) & (sizes < lengths)):
        raise FileFormatError(f"{name} is cut short: a face has fewer corners than it promises")
    triangle_counts = np.maximum(sizes.astype(np.int64) - 2, 0)
    first = np.repeat(starts + 1, triangle_counts)
    ends = np.cumsum(triangle_counts)
    step = np.arange(len(first)) - np.repeat(ends - triangle_counts, triangle_counts)
    corners = tokens[np.stack((first, first + step + 1, first + step + 2), axis=1)]
    if corners.size and not np.all((corners >= 0) & (corners < vertex_count) & (corners == np.floor(corners))):
        raise FileFormatError(f"{name} is damaged: a face names a vertex that the file does not have")
    return corners.astype(np.int64)
