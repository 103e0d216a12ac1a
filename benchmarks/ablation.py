# SPDX-License-Identifier: GPL-3.0-or-later
"""What each choice of the engine gives: the same meshes with one option changed at a time."""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .peers import FIGURES
from .report import machine, table
from .runner import MeshRun, Plan, deviation, load
from .summary import geometric_mean

BASE = "default"
VARIANTS: dict[str, dict[str, Any]] = {
    BASE: {},
    "refit off": {"refit": False},
    "refit without flips": {"flips": False},
    "`qem`, refit off": {"method": "qem", "refit": False},
    "`qem`, refit on": {"method": "qem"},
    "`so` (one ring)": {"method": "so"},
    **{f"{rings} ring{'s' * (rings > 1)}": {"rings": rings} for rings in (1, 2, 3, 4)},
    **{f"{rings} ring{'s' * (rings > 1)}, refit off": {"rings": rings, "refit": False} for rings in (1, 2, 3, 4)},
    **{f"power {power:g}, refit off": {"weight_power": power, "refit": False} for power in (0.25, 0.5, 0.75, 1.0)},
    "preset `paper`": {"preset": "paper"},
    "endpoints": {"placement": "endpoint", "refit": False},
}
KINDS = ("maximum", "mean", "normal", "seconds")


def run_ablation(plan: Plan, say: Callable[[str], None],
                 keep: Callable[[list[dict[str, Any]]], None] = lambda _: None) -> list[dict[str, Any]]:
    """Run every variant over the meshes and ratios of the plan (its peers are not used); return plain rows.

    `keep` is given all rows so far after each mesh.
    """
    rows: list[dict[str, Any]] = []
    end = time.monotonic() + 60 * plan.minutes if plan.minutes else float("inf")
    for name, make in plan.meshes.items():
        if time.monotonic() > end:
            say(f"time is up: {name} is left out")
            continue
        mesh = make()
        with tempfile.TemporaryDirectory() as folder:
            cases = MeshRun(name, mesh, Path(folder), plan, say)
            with cases.stack:
                for ratio in plan.ratios:
                    found = _level(cases, ratio)
                    rows += found
                    say(f"{name} at {ratio:.0%}: {len(found)} of {len(VARIANTS)} variants")
        keep(rows)
    return rows


def _level(cases: MeshRun, ratio: float) -> list[dict[str, Any]]:
    """Run every variant to one level, in turns; who fails is named and left out of this level."""
    target = max(4, round(cases.triangles * ratio))
    seconds: dict[str, list[float]] = {variant: [] for variant in VARIANTS}
    figures: dict[str, dict[str, float]] = {}
    for turn in range(cases.plan.repeat):
        for variant in list(seconds):
            answer = cases.worker(FIGURES["ablation"]).ask(target, VARIANTS[variant])
            if "error" in answer:
                cases.say(f"{cases.name} at {ratio:.0%}: {variant} failed: {answer['error']}")
                del seconds[variant]
                continue
            seconds[variant].append(answer["seconds"])
            if turn == 0:
                figures[variant] = deviation(cases.mesh, load(answer))
    case = {"mesh": cases.name, "ratio": ratio, "triangles": cases.triangles}
    return [
        {**case, "variant": variant, **figures[variant], "seconds": statistics.median(runs)}
        for variant, runs in seconds.items()
    ]


def means(rows: list[dict[str, Any]]) -> dict[str, dict[str, float | None]]:
    """Return each variant's geometric means over the default's, case by case."""
    base = {(row["mesh"], row["ratio"]): row for row in rows if row["variant"] == BASE}
    found: dict[str, dict[str, float | None]] = {}
    for variant in VARIANTS:
        mine = [row for row in rows if row["variant"] == variant and (row["mesh"], row["ratio"]) in base]
        pairs = [(row, base[row["mesh"], row["ratio"]]) for row in mine]
        if pairs:
            found[variant] = {
                kind: geometric_mean(max(a[kind], 1e-9) / max(b[kind], 1e-9) for a, b in pairs) for kind in KINDS
            }
    return found


def write_ablation(folder: Path, rows: list[dict[str, Any]]) -> None:
    """Write ablation.md and ablation.json into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    about, found = machine(), means(rows)
    (folder / "ablation.json").write_text(json.dumps({"about": about, "means": found, "rows": rows}, indent=1) + "\n")
    cases = len({(row["mesh"], row["ratio"]) for row in rows})
    text = [
        "# Ablation",
        f"{about['date']}; {about['machine']}. Geometric means over the default's figures, {cases} cases; "
        "smaller is better, 1 is the default.",
        table(["variant", "maximum", "mean", "normals", "time"], [(name, *v.values()) for name, v in found.items()]),
    ]
    (folder / "ablation.md").write_text("\n\n".join(text) + "\n")
