# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches and meshes larger than memory, measured: python -m benchmarks.farm batch|kills|large FOLDER [options]."""

from __future__ import annotations

import argparse
import os
import random
import resource
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from eso_addon.files.ply import write_ply

ROOT = Path(__file__).parent.parent


def main() -> None:
    """Measure what was asked for, and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("batch", "kills", "large"))
    parser.add_argument("folder", type=Path, help="for what is made; it must not exist")
    parser.add_argument("--files", type=int, default=300)
    parser.add_argument("--models", type=Path, help="a folder of meshes that are taken too")
    parser.add_argument("--every", type=float, default=5.0, help="seconds between two kills")
    parser.add_argument("--triangles", type=int, default=50_000_000)
    parser.add_argument("--goal", type=int, default=1_000_000)
    parser.add_argument("--memory-limit", default="4G")
    args = parser.parse_args()
    args.folder.mkdir(parents=True)
    {"batch": scaling, "kills": kills, "large": large}[args.what](args)


def scaling(args: argparse.Namespace) -> None:
    """Compare two workers with one."""
    library = make_library(args)
    seconds = {}
    for workers in (1, 2):
        started = time.perf_counter()
        subprocess.run(command(library, args.folder / f"out{workers}", workers), cwd=ROOT, check=False)
        seconds[workers] = time.perf_counter() - started
    print(f"{seconds[1]:.1f} s with one worker, {seconds[2]:.1f} s with two: {seconds[1] / seconds[2]:.2f} times")
    print("same results" if results(args.folder / "out1") == results(args.folder / "out2") else "RESULTS DIFFER")


def kills(args: argparse.Namespace) -> None:
    """Kill a process of a run now and then, and compare with a run that is left alone."""
    import psutil

    library, rng, count = make_library(args), random.Random(0), 0
    subprocess.run(command(library, args.folder / "calm", 2), cwd=ROOT, check=False)
    run = subprocess.Popen(command(library, args.folder / "killed", 2), cwd=ROOT)
    while run.poll() is None:
        time.sleep(args.every)
        try:
            below = [child for child in psutil.Process(run.pid).children(recursive=True)
                     if "resource_tracker" not in " ".join(child.cmdline())]
            if below:
                rng.choice(below).kill()
                count += 1
        except psutil.Error:
            continue
    same = results(args.folder / "calm") == results(args.folder / "killed")
    print(f"{count} kills: {'same results' if same else 'RESULTS DIFFER'}")


def large(args: argparse.Namespace) -> None:
    """Simplify a mesh that is made on disk, with the memory of all processes added up as the system tells it."""
    import psutil

    source, target = args.folder / "large.ply", args.folder / "small.ply"
    write_torus(source, args.triangles)
    started, most = time.perf_counter(), 0
    run = subprocess.Popen([sys.executable, "-m", "eso_addon", "simplify", source, target, "--faces", str(args.goal),
                            "--memory-limit", args.memory_limit], cwd=ROOT)
    while run.poll() is None:
        held = 0
        try:
            family = [psutil.Process(run.pid), *psutil.Process(run.pid).children(recursive=True)]
            held = sum(process.memory_info().rss for process in family)
        except psutil.Error:
            pass
        most = max(most, held)
        time.sleep(0.1)
    seconds = time.perf_counter() - started
    print(f"{args.triangles} triangles in {seconds:.0f} s, {seconds / args.triangles * 1e6:.2f} µs each; "
          f"{most / 2**20:.0f} MiB at most, {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024:.0f} in one")


def command(library: Path, output: Path, workers: int) -> list[str]:
    """Give the command of a run."""
    return [sys.executable, "-m", "eso_addon", "batch", str(library.resolve()), str(output.resolve()),
            "--ratios", "0.5,0.1", "--workers", str(workers)]


def results(folder: Path) -> dict[str, object]:
    """Give what a run made: the bytes of its files, and the results of its ledger."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*")
             if path.is_file() and "ledger" not in path.name}
    rows = sqlite3.connect(folder / "ledger.sqlite").execute("SELECT path, result FROM files ORDER BY path").fetchall()
    return {**files, "rows": rows}


def make_library(args: argparse.Namespace) -> Path:
    """Make a folder of meshes, some given and the rest generated."""
    library = args.folder / "library"
    if args.models:
        shutil.copytree(args.models, library / "models")
    (library / "x.obj").mkdir(parents=True)
    (library / "zero.stl").touch()
    given = sum(len(files) for _, _, files in os.walk(library))
    for number in range(max(args.files - given, 0)):
        place = library / f"made{number % 7}"
        place.mkdir(exist_ok=True)
        write_torus(place / f"{number}.ply", 5000 + 997 * (number % 31))
    return library


def write_torus(path: Path, triangles: int) -> None:
    """Write a closed bumpy torus of about so many triangles, in pieces."""
    rows = max(int((triangles / 4) ** 0.5), 3)
    columns = 2 * rows

    def parts() -> Iterator[np.ndarray]:
        for first in range(0, columns, 256):
            yield np.arange(first, min(first + 256, columns))[:, None]

    def vertices() -> Iterator[np.ndarray]:
        for part in parts():
            u, w = part * (2 * np.pi / columns), np.arange(rows) * (2 * np.pi / rows)
            r = 1 + 0.08 * np.sin(7 * u) * np.cos(5 * w) + 0.01 * np.sin(60 * u + 3 * w) * np.sin(41 * w)
            ring = 3 + r * np.cos(w)
            yield np.stack((ring * np.cos(u), ring * np.sin(u), r * np.sin(w)), axis=-1).reshape(-1, 3)

    def faces() -> Iterator[np.ndarray]:
        here = np.arange(rows)
        up = (here + 1) % rows
        for part in parts():
            right = (part + 1) % columns
            a, b, c, d = part * rows + here, right * rows + here, right * rows + up, part * rows + up
            yield np.stack((a, b, c, a, c, d), axis=-1).reshape(-1, 3)

    write_ply(path, vertices(), faces())


if __name__ == "__main__":
    main()
