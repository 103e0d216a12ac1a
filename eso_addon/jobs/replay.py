# SPDX-License-Identifier: GPL-3.0-or-later
"""The last run of the engine, kept so that the redo panel replays it: another ratio costs no other run."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import fields, is_dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from ..core.steps import scaled

if TYPE_CHECKING:
    from ..core.levels import SimplifyResult
    from ..core.recording import Recording

_kept: dict[str, Recording] = {}


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
    key = fingerprint(original, replace(chosen, refit=False, threads=None))  # neither changes the run
    recording = _kept.get(key)
    replayed = recording is not None
    if recording is None:
        recording = yield from scaled(recording_steps(original, chosen, 0), lambda part: 0.8 * part)
        forget()
        _kept[key] = recording
    levels = yield from scaled(
        recording.levels_steps(counts, errors, refit=chosen.refit), lambda part: 0.8 + 0.2 * part
    )
    return levels, replayed


def kept() -> Recording | None:
    """Give the run that is kept, None if there is none."""
    return next(iter(_kept.values()), None)


def forget() -> None:
    """Drop the kept run."""
    _kept.clear()


def fingerprint(*values: Any) -> str:  # noqa: ANN401
    """Hash arrays, plain values, and anything made of them.

    Parameters
    ----------
    *values
        Arrays, numbers, texts, None; dictionaries, tuples, lists and dataclasses of such.

    Returns
    -------
    str
        Equal for equal content alone.
    """
    digest = sha256()
    _feed(digest, values)
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:  # noqa: ANN401
    if hasattr(value, "dtype") and hasattr(value, "tobytes"):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(memoryview(value).cast("B") if value.flags.c_contiguous and value.size else value.tobytes())
    elif isinstance(value, dict):
        _feed(digest, sorted(value.items()))
    elif is_dataclass(value):
        _feed(digest, {field.name: getattr(value, field.name) for field in fields(value)})
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _feed(digest, item)
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())


