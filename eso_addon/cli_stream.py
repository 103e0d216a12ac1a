# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's words for progressive streams: stream, restore, info."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .progressive.progressive import Level

    Triangles = Callable[[Path], tuple[NDArray[np.float64], NDArray[np.int64]]]

ENDING = ".esopm"


def stream(args: argparse.Namespace, triangles: Triangles, options: dict[str, Any]) -> None:
    """Write a file's visible meshes as one progressive stream."""
    from .progressive.progressive import progressive

    vertices, faces = triangles(args.input)
    started = time.perf_counter()
    mesh = progressive(vertices, faces, meta={"name": args.input.stem}, **options)
    size = mesh.save(args.output, bits=args.bits, keep_order=args.keep_order)
    seconds = time.perf_counter() - started
    per_vertex = size / max(mesh.vertex_count, 1)
    print(f"{args.input.stem}: {mesh.face_count} triangles, base of {mesh.base_faces}, {mesh.batches} batches, "
          f"{size} bytes, {per_vertex:.2f} a vertex")
    print(f"{args.output} written, {seconds:.2f} s of work")


def restore(args: argparse.Namespace, write: Callable[[Path, Level], None]) -> None:
    """Write a level of a stream, or the original."""
    from .progressive.progressive import load_progressive

    mesh = load_progressive(args.input, partial=args.partial, max_bytes=args.bytes)
    level = mesh.restore() if args.faces is None else mesh.at(faces=args.faces)
    write(args.output, level)
    if mesh.damage and args.bytes is None:
        print(mesh.damage)
    print(f"{args.output} written: {len(level.faces)} triangles, {len(level.vertices)} vertices")


def info(args: argparse.Namespace) -> None:
    """Say what a stream holds."""
    from .progressive.progressive import load_progressive

    mesh = load_progressive(args.input, partial=True)
    print(f"{args.input.name}: {mesh.face_count} triangles, {mesh.vertex_count} vertices, "
          f"base of {mesh.base_faces}, {mesh.batches} batches, {args.input.stat().st_size} bytes")
    for domain, names in mesh.attribute_names.items():
        print(f"{domain} attributes: {', '.join(names)}")
    for key, value in mesh.meta.items():
        print(f"{key}: {value}")
    if mesh.damage:
        print(mesh.damage)
