# SPDX-License-Identifier: GPL-3.0-or-later
"""pymeshlab's word on a deviation, where it is installed: in a process of its own: it does not go well with bpy."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Generator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

_POLL_SECONDS = 0.1
_LONGEST_SECONDS = 600
# Read by the other Python: it gets the path that this one has, and knows nothing of Blender.
_SCRIPT = """
import json, sys
import numpy, pymeshlab
data = numpy.load(sys.argv[1])
meshes = pymeshlab.MeshSet()
for name in "01":
    meshes.add_mesh(pymeshlab.Mesh(data["v" + name], data["f" + name]))
both = [meshes.get_hausdorff_distance(sampledmesh=a, targetmesh=b, samplevert=True, sampleedge=True, sampleface=True,
                                      samplenum=int(data["samples"]), maxdist=pymeshlab.PercentageValue(100))
        for a, b in ((0, 1), (1, 0))]
print(json.dumps({"maximum": max(x["max"] for x in both), "mean": max(x["mean"] for x in both)}))
"""


def is_there() -> bool:
    """Tell whether pymeshlab is installed; it is not imported."""
    return find_spec("pymeshlab") is not None


def second_opinion_steps(v0: Any, f0: Any, v1: Any, f1: Any, samples: int) -> Generator[float, None, dict[str, float]]:  # noqa: ANN401
    """Let pymeshlab measure; yields while it works, may be closed at any time.

    Parameters
    ----------
    v0, f0, v1, f1
        Original and simplified mesh, as of `measure`.
    samples : int
        Points on each surface.

    Returns
    -------
    figures : dict
        ``maximum`` and ``mean``, the larger of both directions; empty if pymeshlab failed.
    """
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "meshes.npz"
        np.savez(path, v0=v0, f0=f0, v1=v1, f1=f1, samples=samples)
        paths = os.pathsep.join(filter(None, sys.path))
        process = subprocess.Popen([sys.executable, "-c", _SCRIPT, str(path)], stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL, text=True, env={**os.environ, "PYTHONPATH": paths})
        try:
            for _ in range(round(_LONGEST_SECONDS / _POLL_SECONDS)):
                try:
                    output, _ = process.communicate(timeout=_POLL_SECONDS)
                except subprocess.TimeoutExpired:
                    yield 1.0
                    continue
                return json.loads(output.splitlines()[-1]) if process.returncode == 0 else {}
            return {}
        finally:
            process.kill()
            process.communicate()
