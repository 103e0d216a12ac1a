# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator says when it has finished: in the status bar, to scripts, and in the panel."""

from collections.abc import Iterable

import bpy

from ..bridge import objects


def tell(
    operator: bpy.types.Operator,
    context: bpy.types.Context,
    title: str,
    lines: Iterable[str],
    notes: Iterable[str] = (),
) -> None:
    """Report once in one line, with each note as a warning before it, and keep all of it for the panel."""
    lines, notes = list(lines), list(notes)
    for note in notes:
        operator.report({"WARNING"}, note)
    operator.report({"INFO"}, f"{title}: {', '.join(lines)}")
    context.window_manager.eso_last_run.show(title, *lines, *notes)


def triangles(before: int, after: int) -> str:
    """Give both counts and the share that is left."""
    share = f" ({after / before:.1%})" if before else ""
    return f"{before:,} to {after:,} triangles{share}"


def error_text(error: float | None) -> str:
    """Give the error, or say that it is being found."""
    return "error follows" if error is None else f"error {error:.3g}"


def tell_error(name: str, error: float) -> None:
    """Add an error that was found later: to the object of this name if it is a result, and to the panel."""
    obj = bpy.data.objects.get(name)
    if obj is not None and objects.SOURCE in obj:
        obj[objects.ERROR] = error
    last_run = bpy.context.window_manager.eso_last_run
    last_run.lines = last_run.lines.replace(error_text(None), error_text(error))


def notes_of(left_behind: Iterable[str], *results: "object") -> list[str]:
    """List what was not carried and what the engine has to say, each message once."""
    lost = ", ".join(left_behind)
    messages = [message for result in results for message in result.messages]  # type: ignore[attr-defined]
    return [*([f"Not carried: {lost}"] if lost else []), *dict.fromkeys(messages)]
