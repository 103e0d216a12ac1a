# SPDX-License-Identifier: GPL-3.0-or-later
"""Simplify a mesh, or make all levels of an LOD chain in one run."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

from numpy.typing import ArrayLike

from .levels import SimplifyResult
from .mesh import check_mesh
from .options import options_of, targets_of
from .recording import recording_steps
from .steps import run_to_end, scaled


def simplify(vertices: ArrayLike, faces: ArrayLike, *, ratio: float | None = None, faces_target: int | None = None,
             max_error: float | None = None, preset: str = "default", **options: Any) -> SimplifyResult:  # noqa: ANN401
    """Simplify a triangle mesh.

    Parameters
    ----------
    vertices : array_like, (n, 3)
    faces : array_like, (m, 3)
    ratio : float
        Part of the triangles to keep, above 0 and at most 1.
    faces_target : int
        Triangles to keep: reached exactly, or one below.
    max_error : float
        Largest distance between both surfaces, either way, in the mesh's units: the fewest triangles within it.
    preset : str
        "default", or "paper": Equations 8 and 9 as printed.
    **options
        Fields of `Options`; they override the preset's.

    Returns
    -------
    SimplifyResult

    Raises
    ------
    MeshError
        The mesh is not valid, or not exactly one target is given, or an option has no meaning.

    Examples
    --------
    >>> import eso_addon
    >>> result = eso_addon.simplify(vertices, faces, ratio=0.1)
    """
    return run_to_end(simplify_steps(vertices, faces, ratio=ratio, faces_target=faces_target, max_error=max_error,
                                  preset=preset, **options))


def simplify_steps(vertices: ArrayLike, faces: ArrayLike, *, ratio: float | None = None,
                   faces_target: int | None = None, max_error: float | None = None, preset: str = "default",
                   **options: Any) -> Generator[float, None, SimplifyResult]:  # noqa: ANN401
    """Do what `simplify` does in steps: yields progress from 0 to 1, returns the result, may be closed at any time."""
    levels = yield from lod_chain_steps(
        vertices, faces, ratios=None if ratio is None else [ratio],
        faces_targets=None if faces_target is None else [faces_target],
        max_errors=None if max_error is None else [max_error], preset=preset, **options)
    return levels[0]


def lod_chain(vertices: ArrayLike, faces: ArrayLike, ratios: Sequence[float] | None = None, *,
              faces_targets: Sequence[int] | None = None, max_errors: Sequence[float] | None = None,
              preset: str = "default", **options: Any) -> list[SimplifyResult]:  # noqa: ANN401
    """Make several levels of a mesh in one run of the engine.

    Parameters
    ----------
    vertices, faces, preset, **options
        As of `simplify`.
    ratios, faces_targets, max_errors : sequence
        One target a level, of one kind; see `simplify`.

    Returns
    -------
    list of SimplifyResult
        In the order of the targets. Levels are nested: before a refit, each is made of vertices of the finer ones.
    """
    return run_to_end(lod_chain_steps(vertices, faces, ratios, faces_targets=faces_targets, max_errors=max_errors,
                                   preset=preset, **options))


def lod_chain_steps(vertices: ArrayLike, faces: ArrayLike, ratios: Sequence[float] | None = None, *,
                    faces_targets: Sequence[int] | None = None, max_errors: Sequence[float] | None = None,
                    preset: str = "default",
                    **options: Any) -> Generator[float, None, list[SimplifyResult]]:  # noqa: ANN401
    """Do what `lod_chain` does in steps: yields progress from 0 to 1, returns the levels, may be closed at any time."""
    chosen = options_of(preset, options)
    original = check_mesh(vertices, faces)
    counts, errors = targets_of(len(original[1]), ratios, faces_targets, max_errors,
                               needed=chosen.method != "feature")
    least = min(counts) if counts else 0
    recording = yield from scaled(recording_steps(original, chosen, least), lambda part: 0.8 * part)
    return (yield from scaled(recording.levels_steps(counts, errors), lambda part: 0.8 + 0.2 * part))
