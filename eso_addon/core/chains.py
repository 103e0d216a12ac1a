# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of levels for several meshes, one run of the engine each: to ratios, counts, errors, sizes, budgets."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

import numpy as np

from .advice import locks_of, prune_for
from .budget import share_budget
from .levels import Mesh, SimplifyResult
from .mesh import MeshError, check_mesh
from .options import Options, number, targets_of
from .recording import Recording, recording_steps
from .screen import Screen, extent_of
from .steps import scaled

KINDS = ("ratio", "count", "error", "screen", "budget")


@dataclass(frozen=True)
class Goals:
    """What the levels are to be.

    Attributes
    ----------
    kind : str
        "ratio", "count" (triangles of each mesh), "error", "screen" (pixels of the longest side where the level
        begins), or "budget" (triangles of all meshes together).
    values : sequence of float
        One for each level, the finest first.
    screen : Screen
        The picture in which errors are judged.
    """

    kind: str
    values: Sequence[float]
    screen: Screen = field(default_factory=Screen)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise MeshError(f"unknown kind of levels {self.kind!r}: choose one of {', '.join(KINDS)}")
        if not self.values:
            raise MeshError("no level is asked for: give one at least")


@dataclass(frozen=True)
class Level:
    """One level of a chain.

    Attributes
    ----------
    result : SimplifyResult
    distance : float
        From here on the level can be shown, in the mesh's units.
    """

    result: SimplifyResult
    distance: float


@dataclass(frozen=True)
class Chain:
    """The levels of one mesh, the finest first, and what could not be done."""

    levels: tuple[Level, ...]
    messages: tuple[str, ...]


def chains_steps(meshes: Sequence[Mesh], goals: Goals, options: Sequence[Options],
                 copies: Sequence[int] | None = None) -> Generator[float, None, list[Chain]]:
    """Make the levels of several meshes; yields progress from 0 to 1, may be closed at any time.

    Parameters
    ----------
    meshes : sequence of (vertices, faces)
        As `simplify` takes them.
    goals : Goals
    options : sequence of Options
        For each mesh its own, since they hold what the mesh carries.
    copies : sequence of int, optional
        How many times each mesh is there: a budget counts every time.

    Returns
    -------
    list of Chain
        One for each mesh. A level that has not fewer triangles than the one before it is left out, and says so; not
        with a budget, where each level has all meshes.

    Raises
    ------
    MeshError
        A mesh is not valid, or a goal has no meaning.
    """
    checked = [check_mesh(*mesh) for mesh in meshes]
    if goals.kind == "budget":
        return (yield from _budget_steps(checked, goals, options, copies))
    chains = []
    for done, (mesh, own) in enumerate(zip(checked, options, strict=True)):
        chains.append((yield from scaled(_chain_steps(mesh, goals, own),
                                         lambda part, done=done: (done + part) / len(checked))))
    return chains


def _chain_steps(mesh: Mesh, goals: Goals, options: Options) -> Generator[float, None, Chain]:
    counts, errors = _targets(mesh, goals)
    least = min(counts) if counts else 0
    recording = yield from scaled(recording_steps(mesh, options, least), lambda part: 0.8 * part)
    results = yield from scaled(recording.levels_steps(counts, errors), lambda part: 0.8 + 0.15 * part)
    yield 0.95
    return _chain(results, counts, mesh, goals, options)


def _targets(mesh: Mesh, goals: Goals) -> tuple[list[int], list[float]]:
    """Return the levels' counts of triangles, or their errors."""
    if goals.kind == "screen":
        extent = extent_of(*mesh)
        return [], [goals.screen.error_at(extent, size) for size in goals.values]
    if goals.kind == "count":
        counts = [int(number("faces_target", count, 1, 2.0**53, whole=True)) for count in goals.values]
        return counts, []
    ratios, errors = ((goals.values, None) if goals.kind == "ratio" else (None, goals.values))
    return targets_of(len(mesh[1]), ratios, None, errors)


def _budget_steps(meshes: list[Mesh], goals: Goals, options: Sequence[Options],
                  copies: Sequence[int] | None) -> Generator[float, None, list[Chain]]:
    recordings: list[Recording] = []
    for done, (mesh, own) in enumerate(zip(meshes, options, strict=True)):
        run = scaled(recording_steps(mesh, own, 1),
                     lambda part, done=done: 0.8 * (done + part) / len(meshes))
        recordings.append((yield from run))
    shares = share_budget(recordings, [int(total) for total in goals.values], copies)
    chains = []
    for done, (mesh, recording, own) in enumerate(zip(meshes, recordings, options, strict=True)):
        counts = [int(count) for count in shares[:, done]]
        results = yield from scaled(recording.levels_steps(counts, []),
                                    lambda part, done=done: 0.8 + 0.2 * (done + part) / len(meshes))
        chains.append(_chain(results, counts, mesh, goals, own))
    times = [1] * len(meshes) if copies is None else list(copies)
    return _with_shortfalls(chains, (shares @ np.array(times)).tolist(), goals)


def _with_shortfalls(chains: list[Chain], sums: Sequence[int], goals: Goals) -> list[Chain]:
    """Have the first chain say which totals the engine could not get down to."""
    short = tuple(f"stopped at {left} of {total:g} triangles in all: no further edge can go without changing the "
                  "topology; prune small parts to go on"
                  for left, total in zip(sums, goals.values, strict=True) if left > total)
    return [Chain(chains[0].levels, (*chains[0].messages, *short)), *chains[1:]]


def _advice(result: SimplifyResult, target: int, options: Options) -> list[str]:
    """Say what would get a level down to its target."""
    found = []
    if prune := prune_for(result, target):
        size, parts = prune
        found.append(f"pruning at {size:g} would reach {target} triangles, without {parts} "
                     f"small part{'s' if parts > 1 else ''}")
    if locks := locks_of(options):
        found.append(f"what is locked holds triangles: release {', '.join(locks)} to go on")
    return found


def _chain(results: list[SimplifyResult], counts: list[int], mesh: Mesh, goals: Goals, options: Options) -> Chain:
    """Judge the levels: leave out copies of the one before, say what would help, find the distances."""
    levels: list[Level] = []
    messages: list[str] = []
    extent = extent_of(*mesh)
    for index, result in enumerate(results):
        messages += [text for text in result.messages if text not in messages]
        if not result.reached and counts:
            messages += [text for text in _advice(result, counts[index], options) if text not in messages]
        is_copy = levels and len(result.faces) >= len(levels[-1].result.faces)
        if is_copy and goals.kind != "budget":  # whose levels need every mesh, to add up
            messages.append(f"level {index} is left out: it would be a copy of the level before, which has "
                            f"{len(levels[-1].result.faces)} triangles")
            continue
        distance = goals.screen.distance_for_error(result.error)  # which is probed here, not in the window's thread
        if goals.kind == "screen":
            distance = goals.screen.distance_for_size(extent, goals.values[index])
        levels.append(Level(result, max(distance, levels[-1].distance if levels else 0.0)))
    return Chain(tuple(levels), tuple(messages))
