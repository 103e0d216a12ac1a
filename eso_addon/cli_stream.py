# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's words for progressive streams: stream, restore, info."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_numbers import bits, count, epsilon

if TYPE_CHECKING:
    from .progressive.progressive import Level
    from .progressive.scene import Scene

ENDING = ".esopm"


def add_words(words: Any, mesh_path: Callable[[str], Path], formats: Sequence[str],  # noqa: ANN401 - argparse's own
              methods: Sequence[str]) -> None:
    """Add the words to the parser; `mesh_path` reads the name of a mesh file."""
    one_of = f"one of {' '.join(formats)}"
    stream = words.add_parser("stream", help="write a progressive stream",
                              description="Write all visible meshes of a file as one progressive stream.")
    stream.set_defaults(run=_stream)
    stream.add_argument("input", type=mesh_path, metavar="IN", help=one_of)
    stream.add_argument("output", type=stream_path, metavar="OUT", help=f"a {ENDING} file")
    stream.add_argument("--method", choices=methods, help="which edges go first (default: qem)")
    stream.add_argument("--epsilon", type=epsilon, metavar="X",
                        help="for the method feature: hold edges whose virtual edge weighs less, from -1 to 1")
    stream.add_argument("--bits", type=bits, metavar="N", help="bits of a coordinate, 4 to 24; lossless without")
    stream.add_argument("--keep-order", action="store_true", help="keep the order of vertices and faces")
    restore = words.add_parser("restore", help="write a level of a stream",
                               description="Write the original of a stream, or a level of it.")
    restore.set_defaults(run=_restore)
    restore.add_argument("input", type=stream_path, metavar="IN", help=f"a {ENDING} file")
    restore.add_argument("output", type=mesh_path, metavar="OUT", help=f"{one_of}; exact in .blend, .glb and .ply")
    limits = restore.add_mutually_exclusive_group()
    limits.add_argument("--faces", type=count, metavar="N", help="triangles at most, of all meshes together")
    limits.add_argument("--bytes", type=count, metavar="N", help="use so many bytes of the file")
    restore.add_argument("--partial", action="store_true", help="of a damaged file, write what is good")
    info = words.add_parser("info", help="say what a stream holds", description="Say what a stream holds.")
    info.set_defaults(run=_info)
    info.add_argument("input", type=stream_path, metavar="IN", help=f"a {ENDING} file")


def stream_path(word: str) -> Path:
    """Read the name of a stream."""
    if Path(word).suffix.lower() != ENDING:
        raise argparse.ArgumentTypeError(f"{word} must end in {ENDING}")
    return Path(word)


def _stream(args: argparse.Namespace) -> None:
    from .files.atomic import check_place

    check_place(args.output)
    if args.epsilon is not None and args.method not in (None, "feature"):
        raise ValueError("--epsilon belongs to the method feature: leave out one of them")
    options = {} if args.method is None else {"method": args.method}
    if args.epsilon is not None:
        options = {"method": "feature", "epsilon": args.epsilon}
    read = _read_off if args.input.suffix.lower() == ".off" else _read_scene
    make, notes = read(args.input, args.keep_order)
    started = time.perf_counter()
    scene = make(options)
    size = scene.save(args.output, bits=args.bits, keep_order=args.keep_order)
    seconds = time.perf_counter() - started
    vertices = sum(mesh.vertex_count for mesh in scene.meshes)
    for note in notes:
        print(note, file=sys.stderr)
    for name, mesh in _named(scene):
        print(f"{name}: {mesh.face_count} triangles, base of {mesh.base_faces}, {mesh.batches} batches")
    print(f"{args.output} written: {size} bytes, {size / max(vertices, 1):.2f} a vertex, {seconds:.2f} s of work")


def _named(scene: Scene) -> list[tuple[str, Any]]:
    """Return each mesh with the names of its objects."""
    names: dict[int, list[str]] = {}
    for entry in scene.meta.get("objects", []):
        names.setdefault(entry["mesh"], []).append(entry["name"])
    return [(", ".join(names.get(number, [f"mesh {number + 1}"])), mesh) for number, mesh in enumerate(scene.meshes)]


def _read_off(path: Path, _keep_order: bool) -> tuple[Callable[[dict[str, Any]], Scene], list[str]]:
    """Read an .off file: no Blender needed."""
    import numpy as np

    from .files.off import read_off
    from .progressive.progressive import progressive
    from .progressive.scene import Scene

    vertices, faces = read_off(path)

    def make(options: dict[str, Any]) -> Scene:
        mesh = progressive(vertices, faces, meta={"name": path.stem}, **options)
        entry = {"name": path.stem, "mesh": 0, "matrix": np.eye(4).ravel().tolist()}
        return Scene([mesh], {"objects": [entry]})

    return make, []


def _read_scene(path: Path, keep_order: bool) -> tuple[Callable[[dict[str, Any]], Scene], list[str]]:
    """Read a file through Blender."""
    from .bridge.quiet import need_blender

    need_blender()
    from .bridge.stream_files import read_stream_objects
    from .bridge.stream_objects import stream_steps
    from .core.steps import run_to_end

    meshes, meta = read_stream_objects(path, keep_order=keep_order)

    def make(options: dict[str, Any]) -> Scene:
        return run_to_end(stream_steps(meshes, meta, options))

    lost = sorted({name for mesh in meshes for name in mesh.left_behind})
    return make, [f"{path.name}: not carried: {', '.join(lost)}"] if lost else []


def _restore(args: argparse.Namespace) -> None:
    from .files.atomic import check_place
    from .progressive.scene import load_scene

    check_place(args.output)
    scene = load_scene(args.input, partial=args.partial, max_bytes=args.bytes)
    levels = scene.levels(faces=args.faces)
    if args.output.suffix.lower() == ".off":
        _write_off(args.output, scene, levels)
    else:
        from .bridge.quiet import need_blender

        need_blender()
        from .bridge.stream_files import write_levels

        write_levels(args.output, scene, levels)
    if scene.damage and args.bytes is None:
        print(scene.damage, file=sys.stderr)
    print(f"{args.output} written: {sum(len(level.faces) for level in levels)} triangles, "
          f"{sum(len(level.vertices) for level in levels)} vertices")


def _write_off(path: Path, scene: Scene, levels: list[Level]) -> None:
    """Write all objects as one mesh, where they stand in the scene."""
    import numpy as np

    from .files.off import write_off

    entries = scene.meta.get("objects") or [{"mesh": number, "matrix": np.eye(4).ravel()}
                                            for number in range(len(levels))]
    vertices, faces, count = [], [], 0
    for entry in entries:
        level, matrix = levels[entry["mesh"]], np.array(entry["matrix"], np.float64).reshape(4, 4)
        points = level.vertices.astype(np.float64)
        if not np.array_equal(matrix, np.eye(4)):
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
        vertices.append(points)
        faces.append(level.faces.astype(np.int64) + count)
        count += len(points)
    write_off(path, np.concatenate(vertices), np.concatenate(faces))


def _info(args: argparse.Namespace) -> None:
    from .progressive.scene import load_scene

    scene = load_scene(args.input, partial=True)
    vertices = sum(mesh.vertex_count for mesh in scene.meshes)
    print(f"{args.input.name}: {scene.face_count} triangles, {vertices} vertices, {args.input.stat().st_size} bytes")
    for name, mesh in _named(scene):
        print(f"{name}: {mesh.face_count} triangles, {mesh.vertex_count} vertices, base of {mesh.base_faces}, "
              f"{mesh.batches} batches, error of the base {mesh.batch_errors[0]:.3g}")
        for domain, names in mesh.attribute_names.items():
            print(f"  {domain} attributes: {', '.join(names)}")
    for key in ("objects", "materials"):
        entries = scene.meta.get(key)
        if isinstance(entries, list) and entries:
            print(f"{key}: {', '.join(str(entry.get('name')) for entry in entries if isinstance(entry, dict))}")
    if scene.damage:
        print(scene.damage)
