# SPDX-License-Identifier: GPL-3.0-or-later
"""Metro's successor: MeshLab's Hausdorff filter, both ways, in a process of its own (it clashes with Blender)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SAMPLES = 40_000


@dataclass(frozen=True)
class Distances:
    """Distances over the diagonal of the original, each way; or why there are none."""

    forward_max: float = float("nan")
    forward_mean: float = float("nan")
    backward_max: float = float("nan")
    backward_mean: float = float("nan")
    error: str = ""

    @property
    def maximum(self) -> float:
        """The larger maximum of both ways."""
        return max(self.forward_max, self.backward_max)

    @property
    def mean(self) -> float:
        """The larger mean of both ways."""
        return max(self.forward_mean, self.backward_mean)


def distances(original: Path, files: Sequence[str], timeout: float = 1800.0) -> list[Distances]:
    """Measure simplified meshes against their original; a maximum is over samples of vertices, edges and faces.

    A mean is over samples of faces alone, which are spread evenly over the area.
    """
    root = str(Path(__file__).resolve().parent.parent)
    words = [sys.executable, "-m", "evidence.hausdorff", str(original), *files]
    try:
        told = subprocess.run(words, capture_output=True, text=True, timeout=timeout, check=False, cwd=root)
    except subprocess.TimeoutExpired:
        return [Distances(error=f"pymeshlab gave no answer in {timeout:g} s")] * len(files)
    found = [Distances(**json.loads(line)) for line in told.stdout.splitlines() if line.startswith("{")]
    lost = (told.stderr.strip().splitlines() or ["pymeshlab ended early"])[-1]
    return found + [Distances(error=lost)] * (len(files) - len(found))


def _main(original: Path, files: Sequence[str]) -> None:
    import pymeshlab

    def add(meshes: pymeshlab.MeshSet, path: str | Path) -> np.ndarray:
        with np.load(path) as stored:
            meshes.add_mesh(pymeshlab.Mesh(stored["vertices"], stored["faces"].astype(np.int32)))
            return stored["vertices"]

    everything = {"samplevert": True, "sampleedge": True, "sampleface": True}
    for file in files:
        meshes = pymeshlab.MeshSet()
        points = add(meshes, original)
        add(meshes, file)
        found: dict[str, float] = {}
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        for way, (sampled, target) in {"forward": (0, 1), "backward": (1, 0)}.items():
            for kind, samples in (("max", everything), ("mean", {**everything, "samplevert": False,
                                                                 "sampleedge": False})):
                answer = meshes.get_hausdorff_distance(sampledmesh=sampled, targetmesh=target, samplenum=SAMPLES,
                                                       maxdist=pymeshlab.PercentageValue(100), **samples)
                found[f"{way}_{kind}"] = answer[kind] / diagonal
        sys.stdout.write(json.dumps(found) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    _main(Path(sys.argv[1]), sys.argv[2:])
