# SPDX-License-Identifier: GPL-3.0-or-later
"""What became of a library: a table in Markdown and in HTML."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..files.atomic import atomic_output
from .child import work_off
from .ledger import Row

_TITLES = ("File", "Triangles", "Coarsest level", "Deviation", "Seconds", "What became of it")
_STYLE = ("body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:75rem;padding:0 1rem;color:#222}"
          "table{border-collapse:collapse;width:100%}th,td{padding:.3rem .7rem;border-bottom:1px solid #ddd;"
          "text-align:left;vertical-align:top;overflow-wrap:anywhere}td:nth-child(n+2):nth-child(-n+5)"
          "{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}"
          ".bad{background:#fdecea}img{max-width:100%}")
_MOST_PICTURES = 60
_SECONDS_FOR_PICTURES = 1800.0


def write_report(folder: Path, rows: Mapping[str, Row], module: str) -> list[Path]:
    """Write report.md and report.html, with report.png where Blender is there to draw it.

    Parameters
    ----------
    folder
        Of the results.
    rows
        Of the ledger; those that were set aside stand first.
    module
        What a child runs that draws pictures; see `child.Child`.

    Returns
    -------
    list of Path
        The files written.
    """
    ordered = sorted(rows.values(), key=lambda row: (row.result == "done", row.path))
    done = [row for row in ordered if row.result == "done"]
    summary = (f"{len(done)} files done, {len(ordered) - len(done)} set aside; {sum(row.seconds for row in done):.0f} "
               f"seconds of work, {sum(row.triangles for row in done):,} triangles to "
               f"{sum(row.triangles_after for row in done):,} at the coarsest levels.")
    picture = _draw(folder, done, module)
    pages = {"report.md": _markdown(summary, ordered, picture), "report.html": _page(summary, ordered, picture)}
    for name, text in pages.items():
        with atomic_output(folder / name) as draft:
            draft.write_text(text, encoding="utf-8")
    return [folder / name for name in pages] + ([folder / picture] if picture else [])


def _draw(folder: Path, done: Sequence[Row], module: str) -> str:
    """Draw the contact sheet; give its name, empty where there is none."""
    shown = [row for row in done if row.outputs][:_MOST_PICTURES]
    if not shown:
        return ""
    labels = [f"{row.path}  {row.triangles_after:,}" for row in shown]
    request = {"sheet": str(folder / "report.png"), "labels": labels,
               "meshes": [str(folder / row.outputs[-1]) for row in shown]}
    answer = work_off(module, request, _SECONDS_FOR_PICTURES, 2**40)
    return "" if answer.get("error") else "report.png"


def _cells(row: Row) -> list[str]:
    if row.result != "done":
        return [row.path, "", "", "", f"{row.seconds:.2f}", f"set aside: {row.error}"]
    return [row.path, f"{row.triangles:,}", f"{row.triangles_after:,}", f"{row.deviation:.4g}", f"{row.seconds:.2f}",
            "; ".join(("done", *row.notes))]


def _markdown(summary: str, rows: Sequence[Row], picture: str) -> str:
    lines = ["# Levels of a library", "", summary, "", f"| {' | '.join(_TITLES)} |", "|---|--:|--:|--:|--:|---|"]
    lines += [f"| {' | '.join(_plain(cell) for cell in _cells(row))} |" for row in rows]
    return "\n".join([*lines, *(["", f"![The coarsest levels]({picture})"] if picture else []), ""])


def _plain(text: str) -> str:
    """Keep a text within its cell."""
    return " ".join(text.split()).replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;")


def _page(summary: str, rows: Sequence[Row], picture: str) -> str:
    head = "".join(f"<th>{title}</th>" for title in _TITLES)
    body = "\n".join(f"<tr{'' if row.result == 'done' else ' class=bad'}>"
                     + "".join(f"<td>{html.escape(cell)}</td>" for cell in _cells(row)) + "</tr>" for row in rows)
    image = f'<p><img src="{picture}" alt="The coarsest level of each file"></p>' if picture else ""
    return (f'<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>Levels of a library</title>'
            f"<style>{_STYLE}</style>\n<h1>Levels of a library</h1>\n<p>{html.escape(summary)}</p>\n{image}\n"
            f"<table><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></html>\n")
