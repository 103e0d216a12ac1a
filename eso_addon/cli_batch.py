# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's word for a library of files: batch."""

from __future__ import annotations

import argparse
import json
import os
import re
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_numbers import seconds

if TYPE_CHECKING:
    from .farm.ledger import Ledger

_CHILD = f"{__package__}.cli_child"
_OWN = ("input", "output", "scheduler", "workers", "timeout", "memory_limit", "format", "report", "run")
_TARGETS = ("ratios", "faces", "errors", "sizes")
_UNITS = {"": 1, "k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40}


def add_word(words: Any, add_lod: Callable[[argparse.ArgumentParser], None],  # noqa: ANN401 - argparse's own
             formats: Sequence[str]) -> None:
    """Add the word to the parser; `add_lod` adds what it shares with `lod`."""
    batch = words.add_parser(
        "batch", help="write the levels of every file in a folder",
        description="Write the levels of every mesh file below a folder, on several processes or a farm of computers. "
                    "A second run does what is new, changed or failed.")
    batch.set_defaults(run=lambda args: run(args, formats))
    batch.add_argument("input", type=Path, metavar="IN_DIR", help="the folder of meshes")
    batch.add_argument("output", type=Path, nargs="?", metavar="OUT_DIR", help="the folder for their levels")
    where = batch.add_mutually_exclusive_group()
    where.add_argument("--scheduler", default="", metavar="ADDRESS", help="of a Dask scheduler, as tcp://host:8786")
    where.add_argument("--workers", type=workers, metavar="N", help="processes on this computer (default: all cores)")
    batch.add_argument("--timeout", type=seconds, default=1800.0, metavar="S", help="seconds for one file (1800)")
    batch.add_argument("--memory-limit", type=memory, metavar="SIZE",
                       help="memory of one worker, as 4G (default: its share of this computer's)")
    batch.add_argument("--format", choices=formats, help="what the levels' files are (default: as the files)")
    batch.add_argument("--report", action="store_true",
                       help="write report.md, report.html and report.png; without a target, of what is done already")
    add_lod(batch)


def memory(word: str) -> int:
    """Read bytes, as 500M or 4GiB."""
    found = re.fullmatch(r"([\d.]+) ?([kmgt]?)(?:i?b)?", word.strip().lower())
    try:
        size = int(float(found[1]) * _UNITS[found[2]]) if found else 0
    except (ValueError, OverflowError):
        size = 0
    if size < 2**20:
        raise argparse.ArgumentTypeError(f"{word} is no size of memory: give one as 500M or 4G")
    return size


def workers(word: str) -> int:
    """Read a number of processes."""
    if word.isascii() and word.isdigit() and 1 <= int(word) <= 1024:
        return int(word)
    raise argparse.ArgumentTypeError(f"{word} is no number of workers: give 1 or more")


def run(args: argparse.Namespace, formats: Sequence[str]) -> None:
    """Work off a library, or tell what is done of it."""
    from .farm.ledger import NAME, Ledger, sole_run
    from .farm.library import check_folders

    wanted = any(getattr(args, name) for name in _TARGETS)
    if args.output is None:
        if wanted or not args.report:
            raise ValueError("give two folders, that of the meshes and another for their levels")
        args.output = args.input
    if not wanted and not args.report:
        raise ValueError("say what the levels are to be: --ratios, --faces, --errors or --sizes (or --report alone)")
    if not wanted:
        if not (args.output / NAME).is_file():
            raise ValueError(f"{args.output} is no folder of a batch's results: it has no {NAME}")
        with closing(Ledger(args.output)) as ledger:
            _tell(args.output, ledger.rows())
        return
    check_folders(args.input, args.output)
    args.output.mkdir(parents=True, exist_ok=True)
    with sole_run(args.output), closing(Ledger(args.output.resolve())) as ledger:
        _run(args, formats, ledger)


def _run(args: argparse.Namespace, formats: Sequence[str], ledger: Ledger) -> None:
    from . import __version__
    from .farm.batch import run_batch, stopping_well
    from .farm.library import list_library, sweep
    from .farm.progress import Bar

    words = {name: value for name, value in vars(args).items() if name not in _OWN} | {"threads": 1}
    settings = json.dumps({**words, "format": args.format}, sort_keys=True)
    entries = list_library(args.input, args.output, formats, args.format)
    rows = ledger.rows()
    todo = [entry for entry in entries
            if not ledger.is_done(rows.get(entry.name), entry.digest, settings, __version__)]
    print(f"{len(entries)} files, {len(entries) - len(todo)} of them done already")
    bar = Bar(len(todo), sum(entry.size for entry in todo))
    sweep(args.output)
    try:
        with stopping_well():
            run_batch(todo, words, ledger, __version__, settings, _farm(args), _CHILD,
                      lambda row, size: bar.step(size, failed=row.result != "done"))
    except KeyboardInterrupt:
        raise ValueError(f"stopped with {bar.done} of {len(todo)} files done: the same command goes on") from None
    finally:
        bar.close()
        sweep(args.output)
    rows = ledger.rows()
    found = {entry.name: rows[entry.name] for entry in entries}
    for row in found.values():
        if row.error:
            print(f"{row.path}: {row.error}")
    if args.report:
        _tell(args.output, found)
    failed = sum(row.result != "done" for row in found.values())
    print(f"{len(found) - failed} files done in {args.output}")
    if failed:
        raise ValueError(f"{failed} of {len(found)} files were set aside: see above, and {args.output}")


def _farm(args: argparse.Namespace) -> Any:  # noqa: ANN401 - a Farm
    from .farm.batch import Farm
    from .farm.machine import cores, memory_of_machine

    count = args.workers or cores()
    return Farm(args.scheduler, count, args.timeout, args.memory_limit or memory_of_machine() // count)


def _tell(folder: Path, rows: Any) -> None:  # noqa: ANN401 - rows of the ledger
    from .farm.report import write_report

    for path in write_report(folder, rows, _CHILD):
        print(f"{os.path.relpath(path)} written")
