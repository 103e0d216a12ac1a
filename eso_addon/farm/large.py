# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify a mesh larger than memory: cells of space, borders held, then the whole, or cells cut elsewhere."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.mesh import MeshError
from ..core.simplify import simplify
from .cells import CUTS, Joined, Source, deal
from .machine import own_memory

Ints = NDArray[np.int64]

# bytes for a triangle, measured: in the engine, in a cell, and for one of the result that is fitted to its original;
# and what a process takes before it has any
WHOLE, CELL, FITTED, IDLE = 400, 600, 1500, 90 * 2**20
_LEAST_CELL = 20_000
_SPARE = 4  # how much finer than the goal the cells' levels are, if that fits
# times the goal: what rounds of cells leave where the whole never fits; each simplifies the borders of the one before
_STEPS = (_SPARE, 2, 1.3, 1.08, 1)
# times the root of a cell's triangles: so many must be left of it, for those along its border to be few among them
_BORDER = 30.0
_FURTHER = 4  # how much further a cell may have to go than another

Run = Callable[[Sequence[Mapping[str, Any]]], Iterator[Mapping[str, Any]]]


@dataclass(frozen=True)
class Plan:
    """What may be used.

    Attributes
    ----------
    memory : int
        Bytes, of all processes together.
    workers : int
        Processes beside this one.
    run : callable
        Has requests for `cell.answer` worked off, and gives the answers in their order.
    tell : callable
        Called with what is done, in words.
    threads : int, optional
        Of the engine, where the whole mesh is in its hands.
    """

    memory: int
    workers: int
    run: Run
    tell: Callable[[str], None]
    threads: int | None = None

    @property
    def of_worker(self) -> int:
        """Bytes for each worker."""
        return (self.memory - own_memory()) // self.workers

    def in_cell(self, part: float = 0.0) -> int:
        """Triangles that a worker can take, if such a part of them is left and fitted."""
        return int((self.of_worker - IDLE) / (CELL + FITTED * part))

    def at_once(self, goal: int) -> int:
        """Triangles that this process can take, to simplify them to so many."""
        return max((self.memory - max(own_memory(), IDLE) - FITTED * goal) // WHOLE, 0)


@dataclass(frozen=True)
class Large:
    """A simplified mesh in blocks.

    Attributes
    ----------
    vertices, faces, triangles : callable
        Each gives blocks: (b, 3) float64 positions; (b, 3) int64 corners; (b, 3, 3) float64 positions of corners.
    before, after : int
        Triangles.
    messages : tuple of str
        What could not be done, what was mended.
    """

    vertices: Callable[[], Iterator[NDArray[np.float64]]]
    faces: Callable[[], Iterator[Ints]]
    triangles: Callable[[], Iterator[NDArray[np.float64]]]
    before: int
    after: int
    messages: tuple[str, ...]


class _Whole:
    """A mesh in memory, as a `cells.Source` and as blocks."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray) -> None:
        self._vertices, self._faces = vertices, faces

    def vertices(self) -> Iterator[NDArray[np.float64]]:
        yield self._vertices

    def faces(self) -> Iterator[Ints]:
        yield self._faces

    def triangles(self) -> Iterator[NDArray[np.float64]]:
        yield self._vertices[self._faces]


def simplify_large(source: Source, target: Callable[[int], int], options: Mapping[str, Any], folder: Path,
                   plan: Plan) -> Large:
    """Simplify triangles that do not fit into memory.

    Parameters
    ----------
    source
        The triangles; corners at equal positions are one vertex.
    target
        Gives the triangles to keep, of how many there are.
    options
        What `simplify` takes.
    folder
        For what does not fit into memory; it may hold several times what the source does.
    plan

    Returns
    -------
    Large
        It reads from the folder where the result does not fit into memory either.

    Raises
    ------
    MeshError
        The memory is too little, the mesh is not valid, or a worker failed.
    """
    if plan.in_cell() < _LEAST_CELL:
        raise MeshError(f"{plan.memory / 2**20:.0f} MiB are too little for {plan.workers} worker(s): raise "
                        "--memory-limit or lower --workers")
    before = source.count()
    if before == 0:
        raise MeshError("the mesh has no faces: there is nothing to simplify")
    goal = target(before)
    left, joined = before, source
    goals = _goals(before, goal, plan.at_once(min(goal, before)), plan.in_cell())
    # what is followed by the whole is fitted then; cells are fitted round by round, the first time to the original
    fit = goal in goals and bool(options.get("refit", True))
    for number, wanted in enumerate(goals):
        place = folder / f"round_{number}"
        joined = _round(joined, left, wanted, options, place, number, plan, fit=fit)
        if number:
            shutil.rmtree(folder / f"round_{number - 1}")
        now = joined.count()
        plan.tell(f"{left} triangles simplified to {now} in {len(joined.cells)} cells")
        stuck, left = now >= left, now
        if stuck:
            break
    if not isinstance(joined, Joined) or left > goal and left <= plan.at_once(goal):
        return _finish(joined, goal, before, options, plan)
    short = (f"stopped at {left} of {goal} triangles: no further edge can go without changing the topology",)
    return Large(joined.vertices, joined.faces, lambda: joined.blocks(_block(plan)), before, left,
                 short if left > goal else ())


def _goals(before: int, goal: int, at_once: int, cell: int) -> list[int]:
    """Return the triangles after each round of cells; what the last leaves is simplified as a whole, if it is more.

    What stands along a round's borders stays as fine as it was, and the rest is the coarser for it: so the steps are
    small, and the next round, whose cells are cut elsewhere, or the run on the whole makes up for it.
    """
    if before <= at_once:
        return []
    if _SPARE * goal <= at_once:
        last = [min(max(_SPARE * goal, before // 10), at_once)]
    elif goal * 1.5 <= at_once:
        last = [_SPARE * goal, min(2 * goal, at_once)]
    else:
        last = [round(step * goal) for step in _STEPS]
    part = min(_BORDER / cell**0.5, 0.5)
    first = [before]
    while first[-1] * part > last[0]:
        first.append(round(first[-1] * part))
    return [*first[1:], *(wanted for wanted in last[:-1] if wanted < 0.9 * first[-1]), last[-1]]


def _block(plan: Plan) -> int:
    """Return the triangles that are read at once."""
    return int(np.clip(plan.memory // 16 // 400, 4096, 1 << 18))


def _round(source: Source, before: int, wanted: int, options: Mapping[str, Any], folder: Path, number: int,
           plan: Plan, *, fit: bool) -> Joined:
    """Simplify the cells of a mesh to so many triangles in all."""
    folder.mkdir()
    most = plan.in_cell(wanted / before if fit else 0.0)
    counts, scale = deal(source, folder, before, most * 3 // 4, CUTS[number % len(CUTS)], _block(plan))
    if counts.max() > most * 1.3:
        raise MeshError(f"{counts.max()} triangles lie too close together for a cell: raise --memory-limit")
    cells = np.flatnonzero(counts).tolist()
    common = {"folder": str(folder)}
    part = wanted / before / _FURTHER
    requests = [{**common, "do": "run", "cell": cell, "dtype": source.dtype.newbyteorder("=").str, "scale": scale,
                 "least": max(int(counts[cell] * part), 1), "threads": 1, "options": dict(options)} for cell in cells]
    ladders = {}
    for cell, answer in zip(cells, _checked(plan.run(requests)), strict=True):
        ladders[cell] = answer
        for kind in ("inner", "mixed", "held"):
            (folder / f"cell_{cell}.{kind}").unlink(missing_ok=True)
        plan.tell(f"cell {len(ladders)} of {len(cells)}")
    full = [cell for cell in cells if ladders[cell]["left"][0]]
    shares = share([ladders[cell] for cell in full], wanted)
    cuts = [{**common, "do": "cut", "cell": cell, "count": count, "fit": fit}
            for cell, count in zip(full, shares, strict=True)]
    for cell, _ in zip(full, _checked(plan.run(cuts)), strict=True):
        (folder / f"record_{cell}.npz").unlink()
    return Joined.of(folder, full)


def share(ladders: Sequence[Mapping[str, Sequence[float]]], wanted: int) -> list[int]:
    """Share triangles among cells, so that the cheapest collapses of all are done.

    Parameters
    ----------
    ladders
        "left" and "cost" of each cell; see `cell.run_cell`.
    wanted
        Triangles in all.

    Returns
    -------
    list of int
        Their sum is what is wanted, if the cells can go so far and are no less to begin with.
    """
    levels = np.unique(np.concatenate([ladder["cost"] for ladder in ladders]))
    lefts = [np.asarray(ladder["left"])[np.searchsorted(ladder["cost"], levels, side="right") - 1]
             for ladder in ladders]
    table = np.stack(lefts)  # (cells, levels), falling along each row
    totals = table.sum(axis=0)
    after = int(np.searchsorted(-totals, -wanted))  # the first level with no more than is wanted
    if after == 0 or after == len(totals):
        return [int(count) for count in table[:, min(after, len(totals) - 1)]]
    part = (totals[after - 1] - wanted) / (totals[after - 1] - totals[after])
    ends = np.cumsum(table[:, after - 1] + part * (table[:, after] - table[:, after - 1]))
    return [int(count) for count in np.diff(np.round(ends), prepend=0)]


def _checked(answers: Iterator[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    for answer in answers:
        if answer.get("error"):
            raise MeshError(f"a cell could not be simplified: {answer['error']}")
        yield answer


def _finish(joined: Source, goal: int, before: int, options: Mapping[str, Any], plan: Plan) -> Large:
    """Simplify what fits into memory, the borders of the cells with it."""
    if isinstance(joined, Joined):
        vertices = np.concatenate(list(joined.vertices()))
        faces = np.concatenate(list(joined.faces()))
    else:
        corners = np.concatenate(list(joined.blocks(_block(plan)))).reshape(-1, 3).astype(np.float64)
        vertices, faces = _welded(corners)
        del corners
    result = simplify(vertices, faces, faces_target=goal, threads=plan.threads, **options)
    whole = _Whole(result.vertices, result.faces)
    return Large(whole.vertices, whole.faces, whole.triangles, before, len(result.faces), result.messages)


def _welded(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], Ints]:
    from ..core.mesh import morton_weld

    order, new = morton_weld(corners)
    number = np.zeros(len(corners), np.int64)
    number[order] = np.cumsum(new) - 1
    return corners[order[new]], number.reshape(-1, 3)
