# SPDX-License-Identifier: GPL-3.0-or-later
"""A peer in a process of its own: requests as JSON lines in, answers as JSON lines out, meshes as .npz files."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from pathlib import Path
from typing import Any, Self, TextIO

import numpy as np

from .peers import FIGURES, PEERS, Peer, Run

TOLERANCE = 0.002
TRIES = 5


class Worker:
    """The parent's end: starts `peer` on the mesh stored in `mesh` and asks it for targets."""

    def __init__(self, peer: Peer, mesh: Path, timeout: float | None = None) -> None:
        self.peer, self.mesh, self.timeout = peer, mesh, timeout
        root = Path(__file__).resolve().parent.parent
        paths = [str(root), *filter(None, [os.environ.get("PYTHONPATH")])]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.worker", peer.name, str(mesh)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL if not os.environ.get("BENCH_DEBUG") else None,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()

    @property
    def ended(self) -> bool:
        """Whether the process is gone: it crashed, or took too long and was ended."""
        return self.process.poll() is not None

    def ask(self, target: int, options: dict[str, Any] | None = None) -> dict[str, Any]:
        """Simplify to `target` triangles; return seconds, peak, faces and out (the .npz file), or error."""
        out = self.mesh.with_name(f"{self.mesh.stem}-{self.peer.name}-{target}.npz".replace(" ", "_"))
        request = {"target": target, "options": {**self.peer.options, **(options or {})}, "out": str(out)}
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            return {"error": "its process has ended"}
        if not select.select([self.process.stdout], [], [], self.timeout)[0]:
            self.process.kill()
            self.process.wait()
            return {"error": f"no answer after {self.timeout:g} s"}
        line = self.process.stdout.readline()
        return json.loads(line) if line else {"error": f"its process ended with code {self.process.wait()}"}


class _Tuner:
    """Asks an adapter again with another target until its triangle count is the one wanted, and remembers how."""

    def __init__(self, peer: Peer, mesh: Path) -> None:
        self.peer = peer
        with np.load(mesh) as stored:
            self.vertices, self.faces = stored["vertices"], stored["faces"]
        self.asked: dict[str, int] = {}

    def run(self, target: int, options: dict[str, Any]) -> Run:
        key = json.dumps([target, options], sort_keys=True)
        if key in self.asked or self.peer.name in FIGURES:
            return self.peer.adapter(self.vertices, self.faces, self.asked.get(key, target), **options)
        runs: dict[int, Run] = {}
        ask = target
        for _ in range(TRIES):
            runs[ask] = self.peer.adapter(self.vertices, self.faces, ask, **options)
            reached = len(runs[ask].faces)
            ask = min(len(self.faces), max(4, round(ask * target / max(1, reached))))
            if abs(reached - target) <= max(2, TOLERANCE * target) or ask in runs:
                break
        best = min(runs, key=lambda asked: abs(len(runs[asked].faces) - target))
        self.asked[key] = best
        return runs[best]


def serve(peer: Peer, mesh: Path, answers: TextIO) -> None:
    """Answer the requests on standard input until it ends."""
    tuner = _Tuner(peer, mesh)
    for line in sys.stdin:
        request = json.loads(line)
        answer: dict[str, Any]
        try:
            run = tuner.run(request["target"], request["options"])
            np.savez(request["out"], vertices=run.vertices, faces=run.faces)
            answer = {"seconds": run.seconds, "peak": run.peak, "faces": len(run.faces), "out": request["out"]}
        except Exception as error:  # a peer may fail in any way; the benchmark goes on and names it
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    # Libraries print to standard output as they like: keep it for the answers alone.
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    serve({**PEERS, **FIGURES}[sys.argv[1]], Path(sys.argv[2]), channel)
