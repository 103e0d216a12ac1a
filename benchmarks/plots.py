# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's plots: deviation over ratio, time over triangles, speed against error."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from .meshes import SPECIAL
from .peers import PEERS
from .summary import Rows, geometric_mean, standing

PLAIN = {"markersize": 5, "linewidth": 1.2}


def _style(peer: str) -> dict[str, object]:
    """Return how a peer is drawn: ours solid with dots, the others dashed with crosses, a colour each."""
    colours, own = plt.get_cmap("tab20").colors, PEERS[peer].ours
    colour = colours[list(PEERS).index(peer) % len(colours)]
    return {"color": colour, "marker": "o" if own else "x", "linestyle": "-" if own else "--"}


def _peers(rows: Rows) -> list[str]:
    present = {row["peer"] for row in rows}
    return [name for name in PEERS if name in present]


def _shared(rows: Rows) -> Rows:
    """Keep the cases that every peer has: a mean over other meshes would not compare."""
    peers = _peers(rows)
    cases = [{(row["mesh"], row["ratio"]) for row in rows if row["peer"] == peer} for peer in peers]
    common = set.intersection(*cases) if cases else set()
    return [row for row in rows if (row["mesh"], row["ratio"]) in common and row["mesh"] not in SPECIAL]


def _deviation(axes: Axes, rows: Rows, figure: str, label: str) -> None:
    for peer in _peers(rows):
        by_ratio = defaultdict(list)
        for row in rows:
            if row["peer"] == peer:
                by_ratio[row["ratio"]].append(row[figure])
        points = sorted((ratio * 100, geometric_mean(values) or 0) for ratio, values in by_ratio.items())
        if points:
            axes.plot(*zip(*points), label=peer, **_style(peer), **PLAIN)
    axes.set(xscale="log", yscale="log", xlabel="triangles kept (%)", ylabel=label)


def _time(axes: Axes, rows: Rows) -> None:
    for peer in _peers(rows):
        found = (row for row in rows if row["peer"] == peer and row["ratio"] == 0.05 and row["mesh"] not in SPECIAL)
        points = sorted((row["triangles"], row["seconds"]) for row in found)
        if points:
            axes.plot(*zip(*points), label=peer, **_style(peer), **PLAIN)
    axes.set(xscale="log", yscale="log", xlabel="triangles of the mesh", ylabel="time of one level at 5 % (s)")


def _speed_and_error(axes: Axes, rows: Rows) -> None:
    for peer, over in standing(rows).items():
        if over["seconds"] and over["mean"]:
            axes.plot(over["seconds"], over["mean"], **{**_style(peer), "linestyle": ""}, markersize=8)
            place = (over["seconds"], over["mean"])
            axes.annotate(peer, place, xytext=(6, 4), textcoords="offset points", fontsize=8)
    axes.set(xscale="log", yscale="log")
    axes.set(xlabel="time over Decimate's (ratio, at 5 %)", ylabel="mean deviation over Decimate's (ratio)")


def draw(folder: Path, rows: Rows) -> None:
    """Draw the three plots as .png and .svg into the folder.

    Parameters
    ----------
    folder : Path
        Must exist.
    rows : list of dict
        From `runner.run`.
    """
    figure, pair = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    shared = _shared(rows)
    _deviation(pair[0], shared, "mean", "mean deviation (of the diagonal)")
    _deviation(pair[1], shared, "maximum", "maximum deviation (of the diagonal)")
    figure.suptitle("Deviation, geometric mean over the meshes")
    _save(folder, "deviation", pair[1])
    figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
    _time(axes, rows)
    _save(folder, "time", axes)
    figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
    _speed_and_error(axes, rows)
    _save(folder, "speed-error", axes)


def _save(folder: Path, name: str, labelled: Axes) -> None:
    figure = labelled.figure
    for axes in figure.axes:
        axes.grid(visible=True, which="both", alpha=0.25)
    if labelled.get_legend_handles_labels()[0]:
        labelled.legend(fontsize=8, loc="best")
    for ending in ("png", "svg"):
        figure.savefig(folder / f"{name}.{ending}", dpi=120)
    plt.close(figure)
