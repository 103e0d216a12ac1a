# SPDX-License-Identifier: GPL-3.0-or-later
"""What `simplify` does with a file that is larger than memory, or larger than it may use."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .cli_batch import memory, workers

_MODULE = f"{__package__}.farm.cell"
# bytes for a triangle that Blender reads and the engine simplifies, measured
_IN_BLENDER = 1500
_FOREVER = 1e9


def add_options(simplify: argparse.ArgumentParser) -> None:
    """Add what bounds the memory."""
    simplify.add_argument("--memory-limit", type=memory, metavar="SIZE",
                          help="memory of all processes together, as 4G: a binary .ply or .stl is read in pieces")
    where = simplify.add_mutually_exclusive_group()
    where.add_argument("--scheduler", default="", metavar="ADDRESS", help="pieces go to the workers of this Dask")
    where.add_argument("--workers", type=workers, metavar="N", help="processes for the pieces (default: all cores)")


def is_large(args: argparse.Namespace) -> bool:
    """Tell whether a file is to be read in pieces: where a limit is given, or the memory would not do."""
    from .farm.machine import memory_left
    from .files.pieces import ENDINGS, open_triangles

    if args.memory_limit is not None:
        return True
    if not {args.input.suffix.lower(), args.output.suffix.lower()} <= set(ENDINGS):
        return False
    try:
        if args.input.stat().st_size * 50 < memory_left():  # no triangle is smaller than 24 bytes
            return False
        return open_triangles(args.input).face_count * _IN_BLENDER > memory_left()
    except (OSError, ValueError):
        return False  # the usual way tells what is wrong


def simplify_file(args: argparse.Namespace, options: dict[str, Any]) -> None:
    """Simplify a file in pieces."""
    from .farm.batch import stopping_well
    from .farm.large import Plan, simplify_large
    from .farm.machine import cores, memory_left
    from .files.pieces import open_triangles

    _check(args, options)
    started = time.perf_counter()
    source = open_triangles(args.input)
    threads = options.pop("threads", None)
    limit = args.memory_limit or int(memory_left() * 0.8)
    count = args.workers or cores()
    while args.workers is None and count > 1 and limit // count < 2**29:
        count -= 1  # few large cells are better than many small ones
    if not args.output.parent.is_dir():
        raise FileNotFoundError(f"cannot write {args.output.name}: the folder {args.output.parent} does not exist")
    try:
        with stopping_well(), tempfile.TemporaryDirectory(prefix=".eso_lod_", dir=args.output.parent) as folder:
            plan = Plan(limit, count, lambda requests: _run(requests, plan.of_worker, count, args.scheduler), _tell,
                        threads)
            result = simplify_large(source, _target(args), options, Path(folder), plan)
            _write(args.output, result, source.dtype)
    except KeyboardInterrupt:
        raise ValueError(f"stopped: {args.output.name} was not written") from None
    _report(args, source, result, time.perf_counter() - started)


def _check(args: argparse.Namespace, options: dict[str, Any]) -> None:
    """Refuse what cannot be done in pieces."""
    from .files.pieces import ENDINGS

    if args.output.suffix.lower() not in ENDINGS:
        raise ValueError(f"{args.output.name} cannot be written in pieces: with --memory-limit give a .ply or .stl")
    if args.ratio is None and args.faces is None:
        raise ValueError("with --memory-limit give --ratio or --faces")
    if options.get("method") == "feature":
        raise ValueError("method feature needs the whole mesh: leave out --memory-limit")
    if options.get("prune"):
        raise ValueError("--prune needs the whole mesh: leave out --memory-limit")
    if not options.pop("weld", True):
        raise ValueError("pieces are joined where their positions are equal: leave out --no-weld")


def _target(args: argparse.Namespace) -> Callable[[int], int]:
    if args.faces is not None:
        return lambda before: args.faces
    return lambda before: max(round(before * args.ratio), 1)


def _run(requests: Any, limit: int, count: int, scheduler: str) -> Any:  # noqa: ANN401 - requests in, answers out
    """Have cells worked off, each in a process that ends with it; give the answers in order."""
    from concurrent.futures import ThreadPoolExecutor

    from .farm.batch import Farm, client_of
    from .farm.child import STOPPING, work_off

    if scheduler:
        with client_of(Farm(scheduler, count, _FOREVER, limit)) as client:
            futures = [client.submit(work_off, _MODULE, request, _FOREVER, limit, keep=False, pure=False)
                       for request in requests]
            for future in futures:
                yield future.result()
        return
    pool = ThreadPoolExecutor(count)
    try:
        futures = [pool.submit(work_off, _MODULE, request, _FOREVER, limit, keep=False) for request in requests]
        for future in futures:
            yield future.result()
    finally:
        STOPPING.set()  # of use after an error or Ctrl-C: nobody waits for cells that nobody wants
        pool.shutdown(cancel_futures=True)
        STOPPING.clear()


def _write(path: Path, result: Any, dtype: Any) -> None:  # noqa: ANN401 - a Large
    from .files.ply import write_ply
    from .files.stl import write_stl

    if path.suffix.lower() == ".ply":
        write_ply(path, result.vertices(), result.faces(), dtype)
    else:
        write_stl(path, result.triangles())


def _tell(text: str) -> None:
    if sys.stdout.isatty():
        sys.stdout.write(f"\r{text}\x1b[K" if text.startswith("cell ") else f"\r{text}\x1b[K\n")
        sys.stdout.flush()
    elif not text.startswith("cell "):
        print(text, flush=True)


def _report(args: argparse.Namespace, source: Any, result: Any, seconds: float) -> None:  # noqa: ANN401
    from .files.figures import write_figures

    lost = [f"{args.input.stem}: not carried over: {', '.join(source.left_behind)}"] if source.left_behind else []
    told = "".join(f"; {text}" for text in result.messages)
    print(f"{args.input.stem}: {result.before} -> {result.after} triangles, in pieces{told}")
    for note in lost:
        print(note)
    print(f"{args.output} written, {seconds:.2f} s of work")
    if args.json:
        mesh = {"name": args.input.stem, "level": 0, "triangles_before": result.before,
                "triangles_after": result.after, "error": None, "reached": not result.messages,
                "messages": list(result.messages), "switch_distance": None}
        figures = {"input": str(args.input), "output": [str(args.output)], "seconds": seconds, "meshes": [mesh],
                   "not_carried_over": lost}
        write_figures(args.json, figures)
