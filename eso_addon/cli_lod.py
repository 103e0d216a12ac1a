# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's word for levels of detail: lod."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_numbers import count, length, list_of, ratio
from .core.steps import run_to_end
from .settings.profiles import PROFILES, Profile

if TYPE_CHECKING:
    from .core.chains import Chain
    from .core.levels import SimplifyResult

HULLS = ("none", "one", "parts")


@dataclass(frozen=True)
class Outcome:
    """What became of one mesh at one level."""

    name: str
    level: int
    triangles_before: int
    triangles_after: int
    error: float
    reached: bool
    messages: tuple[str, ...]
    switch_distance: float | None = None


def add_options(lod: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add what `lod` takes besides the files and the engine's options."""
    targets = lod.add_mutually_exclusive_group(required=required)
    targets.add_argument("--ratios", type=list_of(ratio), metavar="R,R,…", help="share of triangles at each level")
    targets.add_argument("--faces", type=list_of(count), metavar="N,N,…",
                         help="triangles at each level, of all meshes together")
    targets.add_argument("--errors", type=list_of(length), metavar="E,E,…", help="largest deviation at each level")
    targets.add_argument("--sizes", type=list_of(count), metavar="P,P,…",
                         help="pixels of the longest side on screen where each level begins")
    lod.add_argument("--profile", choices=PROFILES, default="plain", help="the engine that names the levels")
    lod.add_argument("--hulls", choices=HULLS, default="none", help="collision hulls: one, or one for each part")
    lod.add_argument("--pixels", type=length, default=1.0, metavar="P", help="error that may be seen, in pixels")
    lod.add_argument("--resolution", type=count, default=1920, metavar="P", help="pixels along the picture's width")
    lod.add_argument("--lens", type=length, default=50.0, metavar="MM", help="focal length on a sensor 36 mm wide")


def lod(args: argparse.Namespace, open_model: Callable[[Path, Path], Any], options: dict[str, Any]) -> None:
    """Write the levels of a file's visible meshes."""
    from .files.atomic import check_place
    from .settings.lod_record import LodSettings, ordered_goals

    profile = PROFILES[args.profile]
    kind, values = next((kind, values) for kind, values in (
        ("ratio", args.ratios), ("budget", args.faces), ("error", args.errors), ("screen", args.sizes)) if values)
    goals = ordered_goals(kind, values)
    if reason := profile.why_not(len(goals)):
        raise ValueError(reason)
    if args.hulls != "none" and not profile.hull:
        raise ValueError(f"{profile.label} has no names for collision hulls: leave out --hulls")
    stem, numbers = args.output.stem, range(len(goals))
    check_place(args.output)
    check_place(args.json, unlike=[args.input, args.output,
                                   *(args.output.with_stem(profile.name(stem, number)) for number in numbers)])
    screen = {"resolution": args.resolution, "lens": args.lens, "pixels": args.pixels}
    settings = LodSettings(kind, goals, screen, options, True, ["ARMATURE"], profile.key)
    model = open_model(args.input, args.output)
    started = time.perf_counter()
    chains = make_chains(model, settings)
    seconds = time.perf_counter() - started
    written = model.write_levels(args.output, chains, profile, settings=json.dumps(settings.stored(())),
                                 hulls=args.hulls)
    report(args, model, chains, profile, seconds, written)


def make_chains(model: Any, settings: Any) -> list[Chain]:  # noqa: ANN401 - a Model of cli.py, and LodSettings
    """Run the engine on each mesh of a file; an error names the mesh."""
    from .core.chains import chains_steps

    goals = settings.goals()
    options = [settings.options(carried) for carried in model.carried]
    if goals.kind == "budget":
        return run_to_end(chains_steps([part[1:] for part in model.parts], goals, options, model.copies))
    chains = []
    for (name, *mesh), own in zip(model.parts, options, strict=True):
        try:
            chains += run_to_end(chains_steps([tuple(mesh)], goals, [own]))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error
    return chains


def report(args: argparse.Namespace, model: Any, chains: Sequence[Chain], profile: Profile,  # noqa: ANN401
           seconds: float, written: list[Path]) -> None:
    """Say what became of each mesh at each level."""
    outcomes = []
    for (name, _, faces), chain in zip(model.parts, chains, strict=True):
        for number, level in enumerate(chain.levels):
            found = outcome(name, number, len(faces), level.result, level.distance)
            outcomes.append(found)
            print(f"{profile.name(name, number)}: {found.triangles_before} -> {found.triangles_after} triangles, "
                  f"error {found.error:.6g}, from a distance of {level.distance:.6g} on")
        for text in chain.messages:
            print(f"{name}: {text}")
    finish(args, model, outcomes, seconds, written)


def finish(args: argparse.Namespace, model: Any, outcomes: Sequence[Outcome], seconds: float,  # noqa: ANN401
           written: list[Path]) -> None:
    """Say what was written, and write the figures to a file if that was asked for."""
    from .files.figures import write_figures

    for note in model.left_behind:
        print(note)
    print(f"{' '.join(map(str, written))} written, {seconds:.2f} s of work")
    if args.json:
        figures = {"input": str(args.input), "output": [str(path) for path in written], "seconds": seconds,
                   "meshes": [asdict(found) for found in outcomes], "not_carried_over": model.left_behind}
        write_figures(args.json, figures)


def outcome(name: str, level: int, before: int, result: SimplifyResult, distance: float | None = None) -> Outcome:
    """Gather what is told of one mesh at one level."""
    return Outcome(name, level, before, len(result.faces), float(result.error), bool(result.reached),
                   tuple(result.messages), distance)
