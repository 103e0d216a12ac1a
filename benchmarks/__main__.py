# SPDX-License-Identifier: GPL-3.0-or-later
"""Ours and every peer in one run: `python -m benchmarks --models DIR`; the results go to out/bench/."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from .ablation import run_ablation, write_ablation
from .meshes import GENERATED, SPECIAL, catalogue
from .peers import PEERS
from .report import read, write
from .runner import Plan, run

QUICK = ("cow", "bunny", "scan250k")


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    folder = os.environ.get("MODELS")
    parser.add_argument("--models", type=Path, default=folder, help="folder of benchmark meshes (default: $MODELS)")
    parser.add_argument("--meshes", type=_words, help="names, separated by commas (default: all)")
    parser.add_argument("--ratios", type=_words, default=["0.2", "0.05", "0.01"], help="(default: 0.2,0.05,0.01)")
    parser.add_argument("--peers", type=_words, help=f"of {', '.join(PEERS)} (default: all)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each case (default: 3)")
    parser.add_argument("--timeout", type=float, default=1800.0, help="seconds that one call may take (default: 1800)")
    parser.add_argument("--minutes", type=float, default=40.0, help="begin nothing new after so many; 0: run all of it")
    parser.add_argument("--quick", action="store_true", help=f"{', '.join(QUICK)} at 5 %%, one run each")
    parser.add_argument("--ablation", action="store_true", help="compare the engine's options instead of the peers")
    parser.add_argument("--from", dest="earlier", type=Path, help="write the report again from this bench.json")
    parser.add_argument("--out", type=Path, default=Path("out/bench"), help="(default: out/bench)")
    return parser


def _chosen(parser: argparse.ArgumentParser, what: str, names: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """Return the chosen names in the order known, or end with a clear error."""
    unknown = sorted(set(names or ()) - set(known))
    if unknown:
        parser.error(f"unknown {what}: {', '.join(unknown)}; there are {', '.join(known)}")
    return [name for name in known if not names or name in names]


def main(words: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0, or 1 when nothing could be measured."""
    parser = _parser()
    told = parser.parse_args(words)
    if told.earlier:
        write(told.out, *read(told.earlier))
        return 0
    if told.models is not None and not told.models.is_dir():
        parser.error(f"{told.models} is not a folder; give one with the benchmark's meshes, or leave --models out")
    meshes = catalogue(told.models)
    if told.quick:
        told.ratios, told.repeat = ["0.05"], 1
        told.meshes = told.meshes or [name for name in QUICK if name in meshes]
    if told.ablation:
        told.meshes = told.meshes or [name for name in meshes if name not in {*GENERATED, *SPECIAL}]
    try:
        ratios = [float(word) for word in told.ratios]
    except ValueError:
        parser.error("--ratios takes numbers between 0 and 1, separated by commas")
    wanted = [PEERS[name] for name in _chosen(parser, "peer", told.peers, list(PEERS))]
    names = _chosen(parser, "mesh", told.meshes, list(meshes))
    skipped = {peer.name: why for peer in wanted if (why := peer.missing())}
    peers = [peer for peer in wanted if peer.name not in skipped]
    plan = Plan({name: meshes[name] for name in names}, ratios, peers, max(1, told.repeat), told.timeout,
                told.minutes or None)
    start = time.monotonic()

    def say(line: str) -> None:
        print(f"[{time.monotonic() - start:6.0f} s] {line}", flush=True)

    for name, why in skipped.items():
        say(f"left out: {name} ({why})")
    if told.ablation:
        run_ablation(plan, say, lambda found: write_ablation(told.out, found))
        say(f"wrote {told.out / 'ablation.md'}")
        return 0
    rows = run(plan, say, lambda found: write(told.out, found, skipped))
    say(f"wrote {told.out / 'bench.md'}")
    return 0 if rows else 1


if __name__ == "__main__":
    sys.exit(main())
