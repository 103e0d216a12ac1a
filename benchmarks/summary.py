# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures that count: geometric means of ratios over the peers, each with its goal."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .meshes import SPECIAL
from .peers import CHAIN, PEERS
from .runner import TIMED_FROM

Rows = list[dict[str, Any]]
Case = tuple[str, float]
SCALED = tuple(name for name in PEERS if name.endswith(" scaled"))
FOREIGN = tuple(name for name, peer in PEERS.items() if not peer.ours)
AS_CALLED = tuple(name for name in FOREIGN if name not in SCALED)
QUALITY, SPEED = "Quality", "Speed"


@dataclass(frozen=True)
class Figure:
    """One line of the summary: a ratio that should be at most its goal; `value` is None where it was not measured."""

    part: str
    name: str
    value: float | None
    goal: float
    cases: int

    @property
    def mark(self) -> str:
        """Return pass, miss or not measured."""
        return "not measured" if self.value is None else "pass" if self.value <= self.goal else "miss"


def geometric_mean(values: Iterable[float]) -> float | None:
    """Return the geometric mean, or None of nothing; zeros count as 1e-9, as flat meshes have no deviation."""
    found = np.maximum(np.fromiter(values, dtype=np.float64), 1e-9)
    return float(np.exp(np.log(found).mean())) if len(found) else None


def _cases(rows: Rows, peer: str) -> dict[Case, dict[str, Any]]:
    """Return a peer's rows by mesh and ratio, the special meshes left out."""
    return {(row["mesh"], row["ratio"]): row for row in rows if row["peer"] == peer and row["mesh"] not in SPECIAL}


def ratios(rows: Rows, ours: str, others: Iterable[str], figure: str, timed: bool = False) -> dict[Case, float]:
    """Return ours over the best of the others, case by case; `timed` keeps 5 % of the meshes that times count for."""
    rivals = [_cases(rows, other) for other in others]
    found = {}
    for case, row in _cases(rows, ours).items():
        best = [rival[case][figure] for rival in rivals if case in rival]
        best = [value for value in best if value == value]  # huge meshes are timed, not measured
        if best and row[figure] == row[figure] and (not timed or (case[1] == 0.05 and row["triangles"] >= TIMED_FROM)):
            found[case] = max(row[figure], 1e-9) / max(min(best), 1e-9)
    return found


def _figure(part: str, name: str, found: Iterable[float], goal: float) -> Figure:
    values = list(found)
    return Figure(part, name, geometric_mean(values), goal, len(values))


def _worst(part: str, name: str, found: Iterable[float], goal: float) -> Figure:
    values = list(found)
    return Figure(part, name, max(values, default=None), goal, len(values))


def _over(rows: Rows, part: str, name: str, ours: str, others: Iterable[str], figure: str, goal: float) -> Figure:
    return _figure(part, name, ratios(rows, ours, others, figure, part == SPEED).values(), goal)


def _speed(rows: Rows) -> list[Figure]:
    fast, scaled, node = "fast-simplification", "fast-simplification scaled", "meshoptimizer"
    table = [
        ("`qem` over Decimate, time at 5 %", "qem", "decimate", "seconds", 0.25),
        ("`eso`, 3 rings, over Decimate, time at 5 %", "eso", "decimate", "seconds", 0.40),
        ("default with refit over Decimate, time at 5 %", "default", "decimate", "seconds", 1.0),
        ("`qem` over fast-simplification, time", "qem", fast, "seconds", 1.0),
        ("`qem` over fast-simplification, mean deviation", "qem", fast, "mean", 0.7),
        ("`qem` over fast-simplification scaled, time", "qem", scaled, "seconds", 1.0),
        ("`qem` over fast-simplification scaled, mean deviation", "qem", scaled, "mean", 0.7),
        ("`qem`, endpoints, over meshoptimizer, time", "qem end", node, "seconds", 2.0),
        ("`qem`, endpoints, over meshoptimizer, mean deviation", "qem end", node, "mean", 1.0),
    ]
    return [_over(rows, SPEED, name, ours, [other], figure, goal) for name, ours, other, figure, goal in table]


def _chain(rows: Rows) -> list[Figure]:
    chain, level, weights = (_cases(rows, f"chain:{name}") for name in ("chain", "eso", "weights"))
    decimated = _cases(rows, "chain:decimate")
    alone, five, share = [], [], []
    for case, row in chain.items():
        others = [decimated[case[0], ratio]["seconds"] for ratio in CHAIN if (case[0], ratio) in decimated]
        if case in level:
            alone.append(row["seconds"] / level[case]["seconds"])
            if case in weights:
                share.append(weights[case]["seconds"] / level[case]["seconds"])
        if len(others) == len(CHAIN):
            five.append(row["seconds"] / sum(others))
    return [
        _figure(SPEED, "chain of five levels over one level at 1 %, time", alone, 1.15),
        _figure(SPEED, "chain of five levels over five Decimates, time", five, 0.08),
        _figure(SPEED, "weights (3 rings) as a part of the call, time", share, 0.35),
    ]


def _growth(rows: Rows) -> list[Figure]:
    found = []
    for name in ("qem", "eso"):
        cases = _cases(rows, name)
        small, large = cases.get(("scan250k", 0.05)), cases.get(("scan4M", 0.05))
        values = [large["seconds"] / small["seconds"]] if small and large else []
        found.append(_figure(SPEED, f"`{name}`, time at 4 M over time at 250 k triangles", values, 18.0))
    return found


def _memory(rows: Rows) -> list[Figure]:
    found = []
    for name in ("qem", "eso", "default"):
        large = [row for row in _cases(rows, name).values() if row["triangles"] >= TIMED_FROM]
        values = [row["bytes_per_triangle"] for row in large]
        label = f"`{name}`, peak memory beyond the input, bytes a triangle, worst case"
        found.append(_worst(SPEED, label, values, 500.0))
    return found


def _special(rows: Rows) -> list[Figure]:
    found = []
    for name in ("qem", "eso"):
        scan = _cases(rows, name).get(("scan250k", 0.05))
        for shape in SPECIAL:
            alike = [row["seconds"] for row in rows if (row["mesh"], row["peer"]) == (shape, name)]
            values = [seconds / scan["seconds"] for seconds in alike] if scan else []
            found.append(_figure(SPEED, f"`{name}`, {shape} over a scan of the same size, time", values, 2.0))
    return found


def _quality(rows: Rows) -> list[Figure]:
    goals = {"mean": 0.85, "maximum": 0.90, "normal": 0.98}
    labels = {"mean": "mean deviation", "maximum": "symmetric maximum", "normal": "normal deviation"}
    found = []
    for crowd, peers in (("as called", AS_CALLED), ("scaled ones too", FOREIGN)):
        for figure, goal in goals.items():
            name = f"default, {labels[figure]} over the best peer of each case ({crowd})"
            found.append(_over(rows, QUALITY, name, "default", peers, figure, goal))
    for figure, goal in (("mean", 0.72), ("maximum", 0.80)):
        name = f"default, {labels[figure]} over Decimate"
        found.append(_over(rows, QUALITY, name, "default", ["decimate"], figure, goal))
    name = "`eso`, endpoints, mean deviation over meshoptimizer"
    return [*found, _over(rows, QUALITY, name, "eso end", ["meshoptimizer"], "mean", 0.85)]


def summarise(rows: Rows) -> list[Figure]:
    """Return every figure that has a goal, from the rows of one run."""
    return [figure for part in (_speed, _chain, _growth, _memory, _special, _quality) for figure in part(rows)]


def standing(rows: Rows) -> dict[str, dict[str, float | None]]:
    """Return each peer's geometric means over Decimate: maximum, mean, normal, and seconds where times count."""
    names = [name for name in PEERS if _cases(rows, name)]
    return {
        name: {
            figure: geometric_mean(ratios(rows, name, ["decimate"], figure, figure == "seconds").values())
            for figure in ("maximum", "mean", "normal", "seconds")
        }
        for name in names
    }
