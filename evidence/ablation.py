# SPDX-License-Identifier: GPL-3.0-or-later
"""What each choice gives: the table from which the defaults were chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from .cases import FEW_SAMPLES, Level
from .context import Context
from .page import Best, Cell, Plot, Section, Table
from .plots import axes_row

BASE = "default"
VARIANTS: dict[str, dict[str, Any]] = {
    BASE: {},
    "one ring": {"rings": 1},
    "two rings": {"rings": 2},
    "four rings": {"rings": 4},
    "power 0 (QEM)": {"method": "qem"},
    "power 0.25": {"weight_power": 0.25},
    "power 0.75": {"weight_power": 0.75},
    "power 1": {"weight_power": 1.0},
    "planes not weighted by area": {"area_weighted": False},
    "no boundary quadrics": {"boundary_weight": 0.0},
    "no refit": {"refit": False},
    "half-edge collapse": {"placement": "endpoint"},
    "all as printed": {"preset": "paper"},
}
LEVELS = (0.2, 0.05)
LARGEST = 30_000  # triangles
FIGURES = {"maximum": "symmetric maximum", "mean": "mean", "normal": "normals"}


def section(context: Context) -> Section:
    """Make the section."""
    models = [model for model in context.models.values() if model.triangles <= LARGEST]
    variants = VARIANTS
    if context.short:
        models, variants = models[:1], {name: VARIANTS[name] for name in (BASE, "no refit", "all as printed")}
    part = Section("8. Ablation")
    targets = {model.name: [max(round(model.triangles * part), 20) for part in LEVELS] for model in models}
    found, failed = context.pool.chains({model.name: model.mesh for model in models}, variants, targets,
                                        samples=FEW_SAMPLES)
    part.problems += failed
    figures = _means(found)
    part.raw = {"means": figures, "levels": [
        {"model": level.model, "variant": level.variant, "target": level.target, "maximum": level.maximum,
         "mean": level.mean, "normal": level.normal} for level in found]}
    names = ", ".join(model.title for model in models)
    part.blocks.append(
        f"One choice changed at a time, everything else as by default. Geometric means over {len(models)} meshes of "
        f"up to {LARGEST:,} triangles at {' and '.join(f'{level:.0%}' for level in LEVELS)} ({names}), over the "
        "default's figures: above one is worse than the default, below one better. Measured by `measure`, the larger "
        "of both directions.")
    rows: list[list[Cell]] = []
    for name in variants:
        if name in figures:
            cells = [figures[name][kind] for kind in FIGURES]
            rows.append([name, *(Best(value, ".3f") if value < 0.995 else f"{value:.3f}" for value in cells)])
    part.blocks.append(Table("Deviation over the default's (bold: better than the default)",
                             ["variant", *FIGURES.values()], rows))
    part.blocks.append(_plot(figures))
    return part



def _means(found: list[Level]) -> dict[str, dict[str, float]]:
    base = {(level.model, level.target): level for level in found if level.variant == BASE}
    figures: dict[str, dict[str, float]] = {}
    for name in VARIANTS:
        pairs = [(level, base[level.model, level.target]) for level in found
                 if level.variant == name and (level.model, level.target) in base]
        if pairs:
            figures[name] = {kind: float(np.exp(np.mean([
                np.log(max(getattr(level, kind), 1e-9) / max(getattr(other, kind), 1e-9)) for level, other in pairs])))
                for kind in FIGURES}
    return figures


def _plot(figures: dict[str, dict[str, float]]) -> Plot:
    drawing, (axes,) = axes_row(1, width=9.0, height=0.42 * len(figures) + 1.2)
    place = np.arange(len(figures))[::-1]
    for number, (kind, color) in enumerate(zip(FIGURES, ("#c8281e", "#2f74b5", "#9aa6b2"))):
        axes.barh(place + 0.25 - 0.25 * number, [values[kind] - 1 for values in figures.values()], 0.24, left=1,
                  color=color, label=FIGURES[kind])
    axes.axvline(1, color="#1d2733", linewidth=1)
    axes.set_yticks(place, list(figures))
    axes.set(xlabel="deviation over the default's (geometric mean; right of one is worse)")
    axes.legend(loc="upper right")
    return Plot("What each choice gives, over the default.", drawing)
