# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of the engine and its peers, on all processors: one chain of levels for each mesh and variant."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers import PEERS
from benchmarks.readers import Mesh
from benchmarks.worker import Worker

SAMPLES = 16_000  # each way
FEW_SAMPLES = 6_000  # where geometric means over many cases are wanted
TIMEOUT = 300.0

PAPER = {"preset": "paper"}
VARIANTS: dict[str, dict[str, Any]] = {
    "QEM": {**PAPER, "method": "qem"},
    "CF": {**PAPER, "method": "cf"},
    "SO": {**PAPER, "method": "so"},
    **{f"ESO {rings}": {**PAPER, "method": "eso", "rings": rings} for rings in (1, 2, 3, 4)},
    "ESO default": {},
}
FOREIGN = {"Decimate": "decimate", "MeshLab": "meshlab"}


@dataclass(frozen=True)
class Level:
    """One simplified mesh of one variant, and our own measure of it; distances over the diagonal.

    `forward` is from samples of the original to the simplified mesh, `backward` the other way.
    """

    model: str
    variant: str
    target: int
    file: str
    faces: int
    forward_max: float
    forward_mean: float
    backward_max: float
    backward_mean: float
    normal: float

    @property
    def mesh(self) -> Mesh:
        """The simplified mesh."""
        return load(Path(self.file))

    @property
    def mean(self) -> float:
        """The larger mean of both ways."""
        return max(self.forward_mean, self.backward_mean)

    @property
    def maximum(self) -> float:
        """The larger maximum of both ways."""
        return max(self.forward_max, self.backward_max)


class Pool:
    """Processes for the engine, and a folder for the meshes that they hand over."""

    def __init__(self, folder: Path, say: Callable[[str], None]) -> None:
        self.folder, self.say = folder, say
        # each process uses one thread: a fresh one, as libraries at work here do not bear a fork
        self._pool = ProcessPoolExecutor(os.cpu_count() or 1, multiprocessing.get_context("spawn"))

    def close(self) -> None:
        """End the processes."""
        self._pool.shutdown(cancel_futures=True)

    def store(self, name: str, mesh: Mesh) -> Path:
        """Write a mesh for the other processes; return where."""
        path = self.folder / f"{name}.npz"
        if not path.exists():
            np.savez(path, vertices=mesh[0], faces=mesh[1])
        return path

    def chains(self, meshes: dict[str, Mesh], variants: dict[str, dict[str, Any]], targets: dict[str, list[int]],
               foreign: Iterable[str] = (), samples: int = SAMPLES) -> tuple[list[Level], list[str]]:
        """Make every level of every mesh with every variant; return them and a line about each that failed."""
        waiting: dict[Future, tuple[str, str]] = {}
        for name, mesh in meshes.items():
            path = self.store(name, mesh)
            for variant, options in variants.items():
                waiting[self._pool.submit(_chain, path, variant, options, targets[name], samples)] = (name, variant)
        levels: list[Level] = []
        failed: list[str] = []
        for name, mesh in meshes.items():
            for variant in foreign:
                found, errors = _foreign(name, variant, self.store(name, mesh), targets[name])
                levels += found
                failed += errors
                self.say(f"{variant} on {name}")
        for number, future in enumerate(as_completed(waiting), 1):
            name, variant = waiting[future]
            try:
                levels += future.result()
            except Exception as error:  # named on the page; the rest goes on
                failed.append(f"{variant} on {name}: {type(error).__name__}: {error}")
            if number % 10 == 0 or number == len(waiting):
                self.say(f"{number} of {len(waiting)} chains of levels")
        return levels, failed

    def map(self, function: Callable[..., Any], jobs: list[tuple]) -> list[Any]:
        """Call a function with each job's arguments; where one raises, its exception is in its place."""
        results: list[Any] = []
        for future in [self._pool.submit(function, *job) for job in jobs]:
            try:
                results.append(future.result())
            except Exception as error:
                results.append(error)
        return results


def load(path: Path) -> Mesh:
    """Read a mesh that was handed over."""
    with np.load(path) as stored:
        return stored["vertices"], stored["faces"].astype(np.int64)


def _chain(path: Path, variant: str, options: dict[str, Any], targets: list[int], samples: int) -> list[Level]:
    from eso_addon import lod_chain

    mesh = load(path)
    results = lod_chain(*mesh, faces_targets=targets, threads=1, **options)
    return [_measured(path, variant, target, mesh, (result.vertices, result.faces), samples)
            for target, result in zip(targets, results, strict=True)]


def _foreign(name: str, variant: str, path: Path, targets: list[int]) -> tuple[list[Level], list[str]]:
    peer = PEERS[FOREIGN[variant]]
    if why := peer.missing():
        return [], [f"{variant}: {why}"]
    levels, failed = [], []
    with Worker(peer, path, TIMEOUT) as worker:
        for target in targets:
            answer = worker.ask(target)
            if "error" in answer:
                failed.append(f"{variant} on {name} at {target:,} triangles: {answer['error']}")
            else:
                levels.append(_measured(path, variant, target, load(path), load(Path(answer["out"]))))
    return levels, failed


def _measured(path: Path, variant: str, target: int, original: Mesh, mesh: Mesh, samples: int = SAMPLES) -> Level:
    from eso_addon import measure

    found = measure(*original, *mesh, samples=samples, seed=0)
    file = path.with_name(f"{path.stem}-{variant}-{target}.npz".replace(" ", "_"))
    np.savez(file, vertices=mesh[0], faces=mesh[1])
    kinds = {"max": "maximum", "mean": "mean"}
    ways = {f"{way}_{short}": getattr(getattr(found, way), kind) / found.diagonal
            for way in ("forward", "backward") for short, kind in kinds.items()}
    return Level(path.stem, variant, target, str(file), len(mesh[1]), **ways, normal=found.symmetric.normal)


def rows(levels: Iterable[Level]) -> list[dict[str, Any]]:
    """Return levels as plain data, without their files."""
    return [{key: value for key, value in asdict(level).items() if key != "file"} for level in levels]
