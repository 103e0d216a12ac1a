# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's plots: labelled axes, units, and the same look for all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

mpl.use("Agg")
mpl.rcParams.update({
    "svg.fonttype": "none", "svg.hashsalt": "papers", "font.family": "sans-serif", "font.size": 10,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#5b6878", "axes.labelcolor": "#1d2733",
    "axes.grid": True, "grid.color": "#e6ebf0", "axes.axisbelow": True, "legend.frameon": False, "legend.fontsize": 9,
    "axes.titlesize": 11, "figure.facecolor": "white",
})
COLORS = {
    "QEM": "#7a8797", "CF": "#c77d20", "SO": "#8d6bb8", "ESO 1": "#a9cbe8", "ESO 2": "#72a9d8", "ESO 3": "#2f74b5",
    "ESO 4": "#174a7c", "ESO default": "#c8281e", "Decimate": "#3c8f4d", "MeshLab": "#9bb04a", "feature": "#2f74b5",
    "ESO": "#c8281e",
}


def axes_row(count: int, width: float = 4.2, height: float = 3.4) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes side by side, at most three in a row."""
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    every = list(grid.ravel())
    for spare in every[count:]:
        spare.remove()
    return figure, every[:count]


def count_axis(axes: Axes) -> None:
    """Put plain numbers, far enough apart, under a logarithmic axis of counts."""
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.xaxis.set_minor_formatter("")


def line(axes: Axes, x: Sequence[float], y: Sequence[float], label: str, *, printed: bool = False,
         color: str | None = None) -> None:
    """Draw a line with marks: whole for what was measured, dashed and hollow for what a paper prints."""
    shade = color or COLORS.get(label, "#1d2733")
    style: dict[str, Any] = {"linestyle": "--", "markerfacecolor": "white"} if printed else {}
    axes.plot(x, y, label=label, color=shade, linewidth=1.6, marker="o", markersize=4, **style)
