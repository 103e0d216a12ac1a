# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 11 of the ESO paper: surface variation as colours from green to red."""

from __future__ import annotations

import numpy as np

from .context import Context
from .models import Model
from .page import Cell, Pictures, Section, Table

STOPS = np.array([[0.10, 0.60, 0.24], [0.62, 0.78, 0.22], [0.98, 0.82, 0.16], [0.93, 0.45, 0.12], [0.80, 0.09, 0.10]])
RINGS = (1, 3)


def colors_of(values: np.ndarray) -> np.ndarray:
    """Return a colour for each value by its logarithm, green at the fifth percentile and red at the 95th."""
    logs = np.log10(np.maximum(values, 1e-300))
    low, high = np.percentile(logs[values > 0], (5, 95)) if (values > 0).any() else (0.0, 1.0)
    place = np.clip((logs - low) / max(high - low, 1e-12), 0, 1) * (len(STOPS) - 1)
    lower = np.minimum(place.astype(np.int64), len(STOPS) - 2)
    part = (place - lower)[:, None]
    return (1 - part) * STOPS[lower] + part * STOPS[lower + 1]


def section(context: Context) -> Section:
    """Make the section."""
    part = Section("3. Surface variation")
    part.blocks.append(
        "Figure 11 of the ESO paper: the weight of Equation 8 at each vertex, green where the surface varies little, "
        "red where it varies most (by the logarithm, from the 5th to the 95th percentile of each picture). One ring is "
        "the shape operator of Equation 7; three rings spread it over what a vertex comes to stand for.")
    part.raw = []
    rows: list[list[Cell]] = []
    for model in context.eso_models[: 1 if context.short else None]:
        pictures = []
        for rings in RINGS:
            picture, figures = _render(context, model, rings)
            pictures.append((picture, f"{model.title}, {'one ring' if rings == 1 else f'{rings} rings'}"))
            part.raw.append({"model": model.name, "rings": rings, **figures})
            rows.append([model.title, str(rings), *figures.values()])
        part.blocks.append(Pictures(f"{model.label}.", pictures, columns=2))
    part.blocks.append(Table("Weights times the diagonal: percentiles", ["model", "rings", "5th", "median", "95th"],
                             rows))
    return part


def _render(context: Context, model: Model, rings: int) -> tuple[np.ndarray, dict[str, float]]:
    from eso_addon import vertex_weights

    vertices, faces = model.mesh
    weights = vertex_weights(vertices, faces, method="eso", rings=rings)
    used = weights[np.unique(faces)] * np.linalg.norm(np.ptp(vertices, axis=0))
    figures = dict(zip(("p5", "median", "p95"), map(float, np.percentile(used, (5, 50, 95)))))
    return context.picture(model.mesh, model.camera, colors=colors_of(weights), wire=False), figures
