# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `python -m eso_addon WORD …` and `blender --command eso_lod WORD …`."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from . import __version__
from .cli_batch import add_word as add_batch
from .cli_large import add_options as add_large_options
from .cli_large import is_large, simplify_file
from .cli_lod import add_options as add_lod_options
from .cli_lod import finish, lod, make_chains, outcome
from .cli_numbers import count, epsilon, length, ratio
from .cli_serve import add_word as add_serve
from .cli_stream import add_words as add_stream
from .cli_stream import stream_path
from .settings.profiles import Profile

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .core.chains import Chain
    from .core.deviation import Deviation
    from .core.levels import SimplifyResult

    Part = tuple[str, NDArray[np.float64], NDArray[np.int64]]

FORMATS = (".blend", ".fbx", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
METHODS = ("eso", "so", "cf", "qem", "feature")
_LINES = {"seam": "seams of UV and other values", "material": "borders of materials", "sharp": "sharp edges",
          "boundary": "open boundaries"}
_ENGINE_WORDS = ("method", "rings", "preset", "placement", "prune", "weld", "threads", "symmetry",
                 *(f"{line}_lines" for line in _LINES))


class Model(Protocol):
    """A file of meshes: what is in it, and how simplified versions leave it."""

    @property
    def parts(self) -> "list[Part]":
        """Name, vertices and triangles of each mesh."""

    @property
    def copies(self) -> list[int]:
        """How many objects show each part."""

    @property
    def carried(self) -> list[dict[str, Any]]:
        """What each part carries, as options of the engine."""

    @property
    def left_behind(self) -> list[str]:
        """What simplified versions lose."""

    def write_simplified(self, path: Path, results: "Sequence[SimplifyResult]") -> list[Path]:
        """Write one result for each part; give the files written."""

    def write_levels(
        self, path: Path, chains: "Sequence[Chain]", profile: Profile, *, settings: str, hulls: str
    ) -> list[Path]:
        """Write all levels of each part; give the files written."""


class OffModel:
    """An .off file on its way to another: no Blender needed."""

    left_behind: list[str] = []
    copies = [1]
    carried: list[dict[str, Any]] = [{}]

    def __init__(self, path: Path) -> None:
        from .files.off import FileFormatError, read_off

        self.parts = [(path.stem, *read_off(path))]
        if not len(self.parts[0][2]):
            raise FileFormatError(f"{path.name} has no mesh with faces: nothing to work on")

    def write_simplified(self, path: Path, results: "Sequence[SimplifyResult]") -> list[Path]:
        """Write the one result."""
        from .files.off import write_off

        write_off(path, results[0].vertices, results[0].faces)
        return [path]

    def write_levels(
        self, path: Path, chains: "Sequence[Chain]", profile: Profile, *, settings: str, hulls: str
    ) -> list[Path]:
        """Write each level to a file of its own."""
        if hulls != "none":
            raise ValueError(".off files hold no collision hulls: leave out --hulls")
        levels = chains[0].levels
        paths = [path.with_stem(profile.name(path.stem, index)) for index in range(len(levels))]
        for level_path, level in zip(paths, levels, strict=True):
            self.write_simplified(level_path, [level.result])
        return paths


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv
        The words after the program's name; the process's own by default.

    Returns
    -------
    int
        0 done, 1 an error that was told in one line on standard error, 2 wrong usage.
    """
    try:
        args = _parser().parse_args(argv)
    except SystemExit as stop:  # Blender would take it for its own
        return int(stop.code or 0)
    return carry_out(args)


def carry_out(args: argparse.Namespace) -> int:
    """Run what was read from the command line; give the exit code."""
    try:
        args.run(args)
    except OSError as error:
        return _refuse(f"{error.strerror}: {error.filename}" if error.strerror and error.filename else str(error))
    except ValueError as error:
        return _refuse(str(error))
    except KeyboardInterrupt:
        return _refuse("stopped")
    except MemoryError:
        return _refuse(f"{args.input.name} is too large for this computer's memory")
    return 0


def _refuse(message: str) -> int:
    print("eso_lod:", " ".join(message.split()), file=sys.stderr)
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="eso_lod", description="Lighter meshes that keep their shape and features.")
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    words = parser.add_subparsers(required=True, metavar="WORD")
    simplify = _add_word(words, "simplify", _simplify, "write a mesh with fewer triangles", "IN", "OUT")
    targets = simplify.add_mutually_exclusive_group(required=True)
    targets.add_argument("--ratio", type=ratio, metavar="R", help="share of the triangles to keep, of each mesh")
    targets.add_argument("--faces", type=count, metavar="N", help="triangles to keep, of all meshes together")
    targets.add_argument("--max-error", type=length, metavar="E", help="largest deviation, in the file's units")
    targets.add_argument("--epsilon", type=epsilon, metavar="X",
                         help="method feature: go on until only features are left, those whose weight is below X")
    add_large_options(simplify)
    _add_engine_words(simplify)
    lod = _add_word(words, "lod", run_lod, "write several levels of detail", "IN", "OUT")
    add_lod_options(lod)
    _add_engine_words(lod)
    _add_word(words, "measure", _measure, "say how far a mesh is from another", "ORIGINAL", "SIMPLIFIED")
    add_stream(words, _path, FORMATS, METHODS)
    add_serve(words, stream_path)
    add_batch(words, _add_lod_words, FORMATS)
    return parser


def _add_lod_words(batch: argparse.ArgumentParser) -> None:
    add_lod_options(batch, required=False)
    _add_engine_words(batch)


def _add_word(
    words: Any,  # noqa: ANN401 - argparse keeps the type to itself
    name: str,
    run: Callable[[argparse.Namespace], None],
    summary: str,
    first: str,
    second: str,
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = words.add_parser(name, help=summary, description=f"{summary.capitalize()}.")
    parser.set_defaults(run=run)
    parser.add_argument("input", type=_path, metavar=first, help=f"one of {' '.join(FORMATS)}")
    parser.add_argument("output", type=_path, metavar=second, help="the same")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to this file too")
    return parser


def _add_engine_words(parser: argparse.ArgumentParser) -> None:
    """Add the engine's options; one that is not given is left to the engine."""
    parser.argument_default = argparse.SUPPRESS
    parser.add_argument("--method", choices=METHODS, help="how edges are weighed (default: eso)")
    parser.add_argument("--rings", type=count, metavar="N", help="rings of neighbours that a weight looks at")
    parser.add_argument("--preset", choices=("paper",), help="the equations as the paper prints them")
    parser.add_argument("--placement", choices=("optimal", "endpoint"), help="where a new vertex stands")
    parser.add_argument("--prune", type=length, metavar="SIZE", help="drop loose parts smaller than this")
    parser.add_argument("--threads", type=count, metavar="N", help="of the engine (default: 1; 2 for large meshes)")
    parser.add_argument("--no-weld", dest="weld", action="store_false", help="keep vertices at equal positions apart")
    parser.add_argument("--symmetry", choices=("x", "y", "z"), help="symmetric results of symmetric meshes")
    for line, title in _LINES.items():
        parser.add_argument(f"--{line}-lines", choices=("kept", "locked", "ignored"), help=f"{title} (default: kept)")


def _path(word: str) -> Path:
    path = Path(word)
    if path.suffix.lower() not in FORMATS:
        raise argparse.ArgumentTypeError(f"{word} is of no known format; use one of {' '.join(FORMATS)}")
    return path


def _simplify(args: argparse.Namespace) -> None:
    from .files.atomic import check_place
    from .settings.lod_record import LodSettings

    check_place(args.output)
    check_place(args.json, unlike=(args.input, args.output))
    options = _engine_options(args)
    if args.epsilon is not None and options.setdefault("method", "feature") != "feature":
        raise ValueError("--epsilon belongs to --method feature: leave out one of them")
    if is_large(args):
        simplify_file(args, options)
        return
    if args.workers is not None or args.scheduler:
        print("--workers and --scheduler do nothing here: they are for files read in pieces (--memory-limit)",
              file=sys.stderr)
    model = _open(args.input, args.output)
    started = time.perf_counter()
    if args.epsilon is not None:
        options["epsilon"] = args.epsilon
        pairs = zip(model.parts, model.carried, strict=True)
        results = [_simplify_to_epsilon(part, {**options, **carried}) for part, carried in pairs]
    else:
        kind, value = _target({"ratio": args.ratio, "budget": args.faces, "error": args.max_error})
        chains = make_chains(model, LodSettings(kind, [value], {}, options, True, [], ""))
        results = [replace(chain.levels[0].result, messages=chain.messages) for chain in chains]
        if kind == "budget" and value < sum(len(one.faces) * times for one, times in zip(results, model.copies)):
            results = [replace(one, reached=False) for one in results]
    seconds = time.perf_counter() - started
    written = model.write_simplified(args.output, results)
    _report(args, model, results, seconds, written)


def _simplify_to_epsilon(part: "Part", options: dict[str, Any]) -> "SimplifyResult":
    from .core.simplify import simplify

    name, vertices, faces = part
    try:
        return simplify(vertices, faces, **options)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def run_lod(args: argparse.Namespace) -> None:
    """Write the levels of one file."""
    lod(args, _open, _engine_options(args))


def _target(values: dict[str, Any]) -> tuple[str, Any]:
    """Give the one target that was given, under the engine's name for it."""
    return next((keyword, value) for keyword, value in values.items() if value is not None)


def _engine_options(args: argparse.Namespace) -> dict[str, Any]:
    return {word: getattr(args, word) for word in _ENGINE_WORDS if hasattr(args, word)}


def _open(source: Path, target: Path) -> Model:
    if source.suffix.lower() == target.suffix.lower() == ".off":
        return OffModel(source)
    return _scene_files().SceneFile(source)


def _scene_files() -> Any:  # noqa: ANN401 - a module
    from .bridge.quiet import need_blender

    need_blender()
    from .bridge import scene_files

    return scene_files


def _report(
    args: argparse.Namespace, model: Model, results: "Sequence[SimplifyResult]", seconds: float, written: list[Path]
) -> None:
    outcomes = []
    for (name, _, faces), result in zip(model.parts, results, strict=True):
        found = outcome(name, 0, len(faces), result)
        outcomes.append(found)
        counts = f"{found.triangles_before} -> {found.triangles_after} triangles"
        print(f"{name}: {counts}, error {found.error:.6g}" + "".join(f"; {text}" for text in found.messages))
    finish(args, model, outcomes, seconds, written)


def _measure(args: argparse.Namespace) -> None:
    from .core.deviation import measure
    from .files.atomic import check_place
    from .files.figures import write_figures

    check_place(args.json, unlike=(args.input, args.output))
    deviation = measure(*_triangles(args.input), *_triangles(args.output))
    rows = {
        f"{args.input.name} to {args.output.name}": deviation.forward,
        f"{args.output.name} to {args.input.name}": deviation.backward,
        "symmetric": deviation.symmetric,
    }
    width = max(map(len, rows)) + 2
    print(" " * width + "".join(f"{title:>14}" for title in ("maximum", "mean", "RMS", "normal (deg)")))
    for label, row in rows.items():
        print(label.ljust(width) + "".join(f"{value:14.6g}" for value in (row.maximum, row.mean, row.rms, row.normal)))
    worst = deviation.symmetric
    parts = "".join(f"{value / deviation.diagonal:14.6f}" for value in (worst.maximum, worst.mean, worst.rms))
    print("of the diagonal".ljust(width) + parts)
    if args.json:
        write_figures(args.json, _figures(deviation))


def _triangles(path: Path) -> "tuple[NDArray[np.float64], NDArray[np.int64]]":
    if path.suffix.lower() == ".off":
        return OffModel(path).parts[0][1:]
    return _scene_files().world_triangles(path)


def _figures(deviation: "Deviation") -> dict[str, Any]:
    return {
        name: {kind: float(getattr(getattr(deviation, name), kind)) for kind in ("maximum", "mean", "rms", "normal")}
        for name in ("forward", "backward", "symmetric")
    } | {"diagonal": float(deviation.diagonal)}
