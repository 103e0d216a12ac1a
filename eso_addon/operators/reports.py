# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator says when it has finished: in the status bar, to scripts, and in the panel."""

from collections.abc import Iterable

import bpy


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


def notes_of(left_behind: Iterable[str], *results: "object") -> list[str]:
    """List what was not carried and what the engine has to say, each message once."""
    lost = ", ".join(left_behind)
    messages = [message for result in results for message in result.messages]  # type: ignore[attr-defined]
    return [*([f"Not carried: {lost}"] if lost else []), *dict.fromkeys(messages)]
