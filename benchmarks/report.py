# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes what was measured: bench.md, bench.json and, with matplotlib, the plots."""

from __future__ import annotations

import datetime
import json
import os
import platform
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from .summary import QUALITY, SPEED, Figure, Rows, standing, summarise

PACKAGES = ("numpy", "bpy", "pymeshlab", "vtk", "fast-simplification", "pyfqmr")


def machine() -> dict[str, str]:
    """Return what the figures depend on: date, machine and versions."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    versions = []
    for package in PACKAGES:
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return {
        "date": datetime.date.today().isoformat(),
        "machine": f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}",
        "versions": ", ".join(versions),
    }


def table(head: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table; numbers are shown with three digits that count."""

    def show(value: object) -> str:
        if value is None or (isinstance(value, float) and np.isnan(value)):
            return ""
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    rows = ["| " + " | ".join(map(show, line)) + " |" for line in lines]
    return "\n".join(["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *rows])


def _figures(figures: list[Figure], part: str) -> str:
    lines = [(f.name, f.value, f"at most {f.goal:g}", f.mark, f.cases) for f in figures if f.part == part]
    return table(["figure", "measured", "goal", "", "cases"], lines)


def markdown(rows: Rows, skipped: dict[str, str], about: dict[str, str]) -> str:
    """Return the report as Markdown: the figures with goals, each peer over Decimate, every case."""
    figures = summarise(rows)
    over = [(name, *values.values()) for name, values in standing(rows).items()]
    cases = [
        (r["mesh"], r["triangles"], f"{r['ratio']:.0%}", r["peer"], r["seconds"], r["bytes_per_triangle"], r["faces"])
        + tuple(r[name] * 1e5 for name in ("maximum", "mean", "rms"))
        + (r["normal"],)
        for r in rows
        if not r["peer"].startswith("chain:")
    ]
    missed = [r for r in rows if abs(r["faces"] - r["target"]) > max(2, 0.005 * r["target"])]
    missed = [r for r in missed if r["peer"] != "chain:weights"]
    counts = "; ".join(f"{r['peer']} on {r['mesh']}: {r['faces']} for {r['target']}" for r in missed)
    return "\n\n".join(
        [
            "# Benchmark",
            f"{about['date']}; {about['machine']}; {about['versions']}.",
            "Ratios and geometric means count; seconds are medians of interleaved runs on a shared machine. "
            "Distances are symmetric (the larger direction) and relative to the diagonal, normals in degrees. "
            "`qem`, `eso`: refit off; `default`: what `simplify` does when nothing is said; `end`: endpoint placement. "
            '"scaled": the mesh is given with a diagonal of 100, as that peer\'s thresholds are absolute.',
            *(f"Left out: {name} ({why})." for name, why in skipped.items()),
            *([f"Other triangle counts than asked for: {counts}."] if counts else []),
            "## Speed and memory",
            _figures(figures, SPEED),
            "## Quality",
            _figures(figures, QUALITY),
            "## Geometric means over Decimate",
            table(["peer", "maximum", "mean", "normals", "time at 5 %, from 50 k triangles"], over),
            "## Cases",
            table(
                ["mesh", "triangles", "ratio", "peer", "seconds", "bytes a triangle", "reached"]
                + ["maximum, 1e-5", "mean, 1e-5", "RMS, 1e-5", "normals, degrees"],
                cases,
            ),
        ]
    )


def write(folder: Path, rows: Rows, skipped: dict[str, str]) -> None:
    """Write bench.md and bench.json into the folder, and the plots when matplotlib is there.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    rows : list of dict
        From `runner.run`.
    skipped : dict
        Peers that could not run, with the reason.
    """
    folder.mkdir(parents=True, exist_ok=True)
    about = machine()
    figures: list[dict[str, Any]] = [{**vars(figure), "mark": figure.mark} for figure in summarise(rows)]
    plain = [{name: None if value != value else value for name, value in row.items()} for row in rows]
    content = {"about": about, "skipped": skipped, "figures": figures, "standing": standing(rows), "rows": plain}
    (folder / "bench.json").write_text(json.dumps(content, indent=1) + "\n")
    (folder / "bench.md").write_text(markdown(rows, skipped, about) + "\n")
    try:
        from .plots import draw
    except ImportError:
        return
    draw(folder, rows)


def read(path: Path) -> tuple[Rows, dict[str, str]]:
    """Return the rows and the skipped peers of a bench.json."""
    content = json.loads(path.read_text())
    rows = [{name: float("nan") if value is None else value for name, value in row.items()} for row in content["rows"]]
    return rows, content["skipped"]
