# SPDX-License-Identifier: GPL-3.0-or-later
"""The last run of the engine, kept so that the redo panel replays it: another ratio costs no other run."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from ..core.steps import scaled

if TYPE_CHECKING:
    from ..core.levels import SimplifyResult
    from ..core.recording import Recording

_kept: list[tuple[Any, Recording]] = []  # what was asked for, and the run


def replayed_steps(
    vertices: Any,  # noqa: ANN401 - whatever the engine takes as an array
    faces: Any,  # noqa: ANN401
    *,
    targets: dict[str, Any],
    options: dict[str, Any],
) -> Generator[float, None, tuple[list[SimplifyResult], bool]]:
    """Make levels as `lod_chain_steps` does, from the kept run if it is one of the same mesh with the same options.

    A run goes down as far as it can, so that every level can be replayed later.

    Parameters
    ----------
    vertices, faces
        As of `lod_chain`.
    targets : dict
        ``ratios``, ``faces_targets`` or ``max_errors``.
    options : dict
        All other arguments of `lod_chain`.

    Returns
    -------
    levels : list of SimplifyResult
        Equal to those of a fresh run, bit for bit.
    replayed : bool
        Whether no run was needed.
    """
    from ..core.mesh import check_mesh
    from ..core.options import options_of, targets_of
    from ..core.recording import recording_steps

    chosen = options_of(options.get("preset", "default"), {k: v for k, v in options.items() if k != "preset"})
    original = check_mesh(vertices, faces)
    counts, errors = targets_of(
        len(original[1]),
        *(targets.get(name) for name in ("ratios", "faces_targets", "max_errors")),
        needed=chosen.method != "feature",
    )
    asked = original, replace(chosen, refit=False, threads=None)  # neither changes the run
    recording = next((run for earlier, run in _kept if same(earlier, asked)), None)
    replayed = recording is not None
    if recording is None:
        recording = yield from scaled(recording_steps(original, chosen, 0), lambda part: 0.8 * part)
        forget()
        _kept.append((asked, recording))
    levels = yield from scaled(
        recording.levels_steps(counts, errors, refit=chosen.refit), lambda part: 0.8 + 0.2 * part
    )
    return levels, replayed


def kept() -> Recording | None:
    """Give the run that is kept, None if there is none."""
    return _kept[-1][1] if _kept else None


def forget() -> None:
    """Drop the kept run."""
    _kept.clear()


def same(one: Any, other: Any) -> bool:  # noqa: ANN401
    """Tell whether two things have equal content: arrays to the last bit, plain values, and anything made of them.

    Parameters
    ----------
    one, other
        Arrays, numbers, texts, None; dictionaries, tuples, lists and dataclasses of such.
    """
    if type(one) is not type(other):
        return False
    if hasattr(one, "dtype"):
        return bool(one.dtype == other.dtype and one.shape == other.shape and (_bits(one) == _bits(other)).all())
    if is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    if isinstance(one, dict):
        return list(one) == list(other) and all(map(same, one.values(), other.values()))
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


def _bits(array: Any) -> Any:  # noqa: ANN401
    """Give an array whose values are equal where its bits are: a float may be no number."""
    return array.view(f"i{array.itemsize}") if array.dtype.kind == "f" and array.itemsize in (2, 4, 8) else array
