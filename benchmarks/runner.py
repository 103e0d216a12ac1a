# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the cases: each mesh, ratio and peer, the peers taking turns, so that a noisy machine is noisy for all."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .meshes import SPECIAL
from .peers import CHAIN, FIGURES, PEERS, Peer
from .readers import Mesh
from .worker import Worker

LARGE = 500_000  # triangles above which foreign peers run once only
HUGE = 1_500_000  # triangles above which only times are taken, and in a limited time from these peers and ours alone
QUICK = ("decimate", "fast-simplification", "meshoptimizer")
FIRST = 0.05  # the ratio that times are compared at: every mesh is run at it before any at another
SAMPLES = 50_000  # a direction: the mean is steady to about 1 %
TIMED_FROM = 50_000  # triangles from which times, memory and chains count


@dataclass(frozen=True)
class Row:
    """One case of one peer. Distances are relative to the diagonal, the normal deviation is in degrees."""

    mesh: str
    triangles: int
    ratio: float
    peer: str
    runs: list[float]
    seconds: float
    bytes_per_triangle: float
    faces: int
    target: int
    maximum: float
    mean: float
    rms: float
    normal: float


@dataclass(frozen=True)
class Plan:
    """What to run: meshes by name, ratios, peers, repeats, and what time it may take.

    A peer may take `timeout` seconds for one answer. Nothing new is begun after `minutes`, and huge meshes get fewer
    peers and one ratio; without it all is run.
    """

    meshes: dict[str, Callable[[], Mesh]]
    ratios: Sequence[float]
    peers: Sequence[Peer]
    repeat: int = 3
    timeout: float | None = None
    minutes: float | None = None

    def rounds(self) -> list[tuple[str, list[float]]]:
        """Return the meshes to run and at which ratios, in order: the most telling first."""
        first = [ratio for ratio in self.ratios if ratio == FIRST] or list(self.ratios[:1])
        others = [ratio for ratio in self.ratios if ratio not in first]
        found = [(name, [FIRST] if name in SPECIAL else first) for name in self.meshes]
        if others:
            found += [(name, others) for name in self.meshes if name not in SPECIAL]
        return found


def deviation(original: Mesh, simplified: Mesh) -> dict[str, float]:
    """Return maximum, mean and rms relative to the diagonal of the original, and normal in degrees, all symmetric."""
    from eso_addon import measure

    found = measure(*original, *simplified, samples=SAMPLES, seed=0)
    symmetric = found.symmetric
    lengths = {name: getattr(symmetric, name) / found.diagonal for name in ("maximum", "mean", "rms")}
    return {**lengths, "normal": symmetric.normal}


def load(answer: dict[str, Any]) -> Mesh:
    """Return the mesh that an answer of a worker names."""
    with np.load(answer["out"]) as stored:
        return stored["vertices"], stored["faces"]


class MeshRun:
    """The workers of one mesh, one for each peer, and the questions put to them in turns."""

    def __init__(self, name: str, mesh: Mesh, folder: Path, plan: Plan, say: Callable[[str], None]) -> None:
        self.name, self.mesh, self.plan, self.say = name, mesh, plan, say
        self.triangles = len(mesh[1])
        self.stored = folder / f"{name}.npz"
        self.stack = ExitStack()
        self.workers: dict[str, Worker] = {}
        np.savez(self.stored, vertices=mesh[0], faces=mesh[1])

    def worker(self, peer: Peer) -> Worker:
        """Return the peer's worker, started when it is first needed and again after its end."""
        if peer.name not in self.workers or self.workers[peer.name].ended:
            self.workers[peer.name] = self.stack.enter_context(Worker(peer, self.stored, self.plan.timeout))
        return self.workers[peer.name]

    def turns(self, questions: Sequence[tuple[Peer, int]]) -> dict[tuple[str, int], list[dict[str, Any]]]:
        """Put (peer, target) questions in turn, `repeat` times; who fails is named and left out."""
        answers: dict[tuple[str, int], list[dict[str, Any]]] = {}
        failed = set()
        for turn in range(self.plan.repeat):
            for peer, target in questions:
                key = (peer.name, target)
                if key in failed or (turn and not peer.ours and self.triangles > LARGE):
                    continue
                answer = self.worker(peer).ask(target)
                if "error" in answer:
                    failed.add(key)
                    answers.pop(key, None)
                    self.say(f"{self.name}: {peer.name} failed at {target} triangles: {answer['error']}")
                else:
                    answers.setdefault(key, []).append(answer)
        return answers

    def row(self, ratio: float, peer: str, target: int, answers: list[dict[str, Any]], measured: bool = True) -> Row:
        """Sum up the answers to one question."""
        runs = [answer["seconds"] for answer in answers]
        peak = max(answer["peak"] for answer in answers) / self.triangles
        nothing = dict.fromkeys(("maximum", "mean", "rms", "normal"), float("nan"))
        figures = deviation(self.mesh, load(answers[-1])) if measured else nothing
        seconds = statistics.median(runs)
        faces = answers[-1]["faces"]
        return Row(self.name, self.triangles, ratio, peer, runs, seconds, peak, faces, target, **figures)

    def levels(self, ratio: float) -> list[Row]:
        """Simplify to one level with every peer."""
        target = max(4, round(self.triangles * ratio))
        special = self.name in SPECIAL
        huge = self.triangles > HUGE
        few = ("decimate",) if special else QUICK if huge and self.plan.minutes else tuple(PEERS)
        answers = self.turns([(peer, target) for peer in self.plan.peers if peer.ours or peer.name in few])
        return [self.row(ratio, peer, target, found, measured=not huge) for (peer, _), found in answers.items()]

    def figures(self) -> list[Row]:
        """Time the chain of five levels, what it is compared with, and the weights alone."""
        targets = {round(self.triangles * ratio): ratio for ratio in CHAIN}
        last = min(targets)
        foreign = [peer for peer in self.plan.peers if peer.name == "decimate"]
        questions = [(FIGURES["chain"], last), (PEERS["eso"], last), (FIGURES["weights"], last)]
        answers = self.turns(questions + [(peer, target) for peer in foreign for target in targets])
        return [
            self.row(targets[target], f"chain:{peer}", target, found, measured=False)
            for (peer, target), found in answers.items()
        ]


def run(plan: Plan, say: Callable[[str], None], keep: Callable[[list[dict[str, Any]]], None]) -> list[dict[str, Any]]:
    """Run every case.

    Parameters
    ----------
    plan : Plan
    say : callable
        Told one line about each thing that a reader should know.
    keep : callable
        Given all rows so far after each mesh, so that a run that is stopped leaves what it has.

    Returns
    -------
    list of dict
        One `Row` each, as plain data.
    """
    rows: list[dict[str, Any]] = []
    end = time.monotonic() + 60 * plan.minutes if plan.minutes else float("inf")
    for name, ratios in plan.rounds():
        if time.monotonic() > end:
            say(f"time is up: {name} at {', '.join(f'{ratio:.0%}' for ratio in ratios)} is left out")
            continue
        mesh = plan.meshes[name]()
        if plan.minutes and len(mesh[1]) > HUGE and FIRST not in ratios:
            continue
        with tempfile.TemporaryDirectory() as folder:
            cases = MeshRun(name, mesh, Path(folder), plan, say)
            with cases.stack:
                rows += _cases_of(cases, ratios, say)
        keep(rows)
    return rows


def _cases_of(cases: MeshRun, ratios: Sequence[float], say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Run one mesh at some ratios, and at the first of all also what times are summed up from."""
    name, rows = cases.name, []
    for ratio in ratios:
        rows += [asdict(row) for row in cases.levels(ratio)]
        say(f"{name} ({cases.triangles:,} triangles) at {ratio:.0%}: {_line(rows, name, ratio)}")
    own = any(peer.ours for peer in cases.plan.peers)
    if own and TIMED_FROM <= cases.triangles <= HUGE and name not in SPECIAL and ratios == cases.plan.rounds()[0][1]:
        rows += [asdict(row) for row in cases.figures()]
    return rows


def _line(rows: list[dict[str, Any]], mesh: str, ratio: float) -> str:
    found = [row for row in rows if row["mesh"] == mesh and row["ratio"] == ratio]
    return ", ".join(f"{row['peer']} {row['seconds']:.2f} s" for row in found)
