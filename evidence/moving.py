# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables 1 to 5 of the ESO paper: how often each vertex moves under half-edge collapse."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .cases import load
from .context import ESO_MODELS, Context
from .page import Plot, Printed, Section, Table
from .plots import axes_row, line
from .printed import AT_MOST_THREE, AVERAGE_MOVES, MOVES

METHODS = ("qem", "eso")


def moves_of(path: Path, method: str, targets: list[int]) -> list[list[int]]:
    """Return for each target how many vertices moved 0, 1, 2, 3 and more than 3 times."""
    from eso_addon import simplify

    vertices, faces = load(path)
    record = simplify(vertices, faces, faces_target=min(targets), method=method, placement="endpoint", preset="paper",
                      threads=1).record
    found = []
    for target in targets:
        length = record.length_for(target)
        parent = np.arange(len(vertices))
        parent[record.removed[:length]] = record.kept[:length]
        times, place = np.zeros(len(vertices), np.int64), np.arange(len(vertices))
        while True:  # once for each move of the vertex that moves most
            further = parent[place]
            if np.array_equal(further, place):
                break
            times += further != place
            place = further
        found.append(np.bincount(np.minimum(times, 4), minlength=5).tolist())
    return found


def section(context: Context) -> Section:
    """Make the section."""
    part = Section("1. Moving lengths", problems=context.lack(ESO_MODELS))
    part.blocks.append(
        "Under half-edge collapse every vertex that goes takes the place of a neighbour; if that one goes later, the "
        "vertex has moved twice. The paper counts this to choose three rings (Tables 1 to 5). Here with costs of plain "
        "QEM and of ESO, both as printed. *Blue italics* are the paper's. Femur and Isis of the paper are larger "
        "scans than those at hand, so only shares compare.")
    jobs, keys = [], []
    for model in context.eso_models:
        for method in METHODS:
            targets = [context.target(model, percent) for percent in context.percent]
            jobs.append((context.pool.store(model.name, model.mesh), method, targets))
            keys.append((model.name, method))
    found = dict(zip(keys, context.pool.map(moves_of, jobs), strict=True))
    part.problems += [f"{name}, {method}: {moves}" for (name, method), moves in found.items()
                      if isinstance(moves, Exception)]
    found = {key: moves for key, moves in found.items() if not isinstance(moves, Exception)}
    part.raw = [{"model": name, "method": method, "percent": percent, "moved": counts}
                for (name, method), moves in found.items() for percent, counts in zip(context.percent, moves)]
    for model in context.eso_models:
        part.blocks.append(Table(f"{model.label}: vertices by how often they moved",
                                 ["triangles", "costs", "0", "1", "2", "3", "more", "average", "at most 3, %"],
                                 _rows(context, model.name, found)))
    figure, every = axes_row(len(context.eso_models), height=3.0)
    for axes, model in zip(every, context.eso_models):
        for method, color in zip(METHODS, ("#7a8797", "#c8281e")):
            if (model.name, method) in found:
                average = [_average(counts) for counts in found[model.name, method]]
                line(axes, context.percent, average, f"{method.upper()}, here", color=color)
        if model.name in AVERAGE_MOVES:
            line(axes, context.percent, [AVERAGE_MOVES[model.name][p] for p in context.percent], "paper",
                 printed=True, color="#2456b8")
        axes.set(title=model.title, xlabel="triangles left (%)", ylabel="average moves of a vertex", ylim=(0, None),
                 xticks=context.percent)
        axes.legend()
    part.blocks.append(Plot("Average moving length over the triangles left.", figure))
    part.blocks.append(_verdict(found))
    return part


def _average(counts: list[int]) -> float:
    # the paper's average counts "more than 3" as more: it can only be estimated from below by 4
    return sum(times * count for times, count in enumerate(counts)) / sum(counts)


def _rows(context: Context, name: str, found: dict) -> list[list]:
    rows: list[list] = []
    for place, percent in enumerate(context.percent):
        for method in METHODS:
            if (name, method) in found:
                counts = found[name, method][place]
                share = 100 * sum(counts[:4]) / sum(counts)
                rows.append([f"{percent} %", method.upper(), *counts, _average(counts), f"{share:.2f}"])
        if name in MOVES:
            rows.append([f"{percent} %", "*paper*", *(Printed(count) for count in MOVES[name][percent]),
                         Printed(AVERAGE_MOVES[name][percent]), Printed(AT_MOST_THREE[name][percent], ".2f")])
    return rows


def _verdict(found: dict) -> str:
    least = min((100 * sum(counts[:4]) / sum(counts) for moves in found.values() for counts in moves), default=0.0)
    worst = max((_average(counts) for moves in found.values() for counts in moves), default=0.0)
    return (f"**What agrees:** on every model and at every level the average is below three (at most {worst:.2f}), and "
            f"at least {least:.1f} % of the vertices move three times or less: three rings cover what a vertex comes "
            f"to stand for. (\"More\" counts as four in the averages here.)")
