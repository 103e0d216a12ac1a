# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sections say, as one HTML page with nothing beside it, and as Markdown with pictures in a folder."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

SMALL = 1200  # pixels across, of a strip of pictures in Markdown


@dataclass(frozen=True)
class Printed:
    """A figure that a paper prints: shown apart from those of the run."""

    value: float
    form: str = ""


@dataclass(frozen=True)
class Best:
    """The best figure of a line."""

    value: float
    form: str = ""


Cell = str | int | float | None | Printed | Best


@dataclass(frozen=True)
class Table:
    """Rows under a head; floats get three digits that count."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Pictures:
    """Renders with a line under each."""

    caption: str
    items: Sequence[tuple[np.ndarray, str]]
    columns: int = 4


@dataclass(frozen=True)
class Plot:
    """A figure of matplotlib."""

    caption: str
    figure: Figure


Block = str | Table | Pictures | Plot


@dataclass
class Section:
    """One part of the page: text (with `code`, **bold** and lists), tables, pictures, plots, and its raw figures."""

    title: str
    blocks: list[Block] = field(default_factory=list)
    raw: Any = None
    problems: list[str] = field(default_factory=list)

    @property
    def anchor(self) -> str:
        """Its name in links."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


def shown(cell: Cell, form: str = "") -> str:
    """Return a cell as text."""
    if isinstance(cell, Printed | Best):
        return shown(cell.value, cell.form)
    if cell is None or (isinstance(cell, float) and not np.isfinite(cell)):
        return "–"
    if isinstance(cell, float):
        return format(cell, form) if form else f"{cell:,.0f}" if abs(cell) >= 100 else format(cell, "#.3g").rstrip(".")
    return f"{cell:,}" if isinstance(cell, int) else cell


def write(folder: Path, title: str, lead: str, sections: Sequence[Section]) -> None:
    """Write index.html, papers.md and images/ into a folder that is there."""
    (folder / "index.html").write_text(_html(title, lead, sections), encoding="utf-8")
    (folder / "papers.md").write_text(_markdown(folder, title, lead, sections), encoding="utf-8")


def _html(title: str, lead: str, sections: Sequence[Section]) -> str:
    links = "".join(f'<a href="#{section.anchor}">{html.escape(section.title)}</a>' for section in sections)
    body = "".join(_section_html(section) for section in sections)
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
            f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{STYLE}</style></head><body>'
            f"<header><h1>{html.escape(title)}</h1>{_prose(lead)}</header><nav>{links}</nav><main>{body}</main>"
            "</body></html>\n")


def _section_html(section: Section) -> str:
    parts = [f'<section id="{section.anchor}"><h2>{html.escape(section.title)}</h2>']
    parts += [f'<p class="problem">Not here: {html.escape(problem)}</p>' for problem in section.problems]
    for block in section.blocks:
        if isinstance(block, str):
            parts.append(_prose(block))
        elif isinstance(block, Table):
            parts.append(_table_html(block))
        elif isinstance(block, Pictures):
            items = "".join(f'<figure><img alt="{html.escape(label, quote=True)}" src="{_webp(picture)}">'
                            f"<figcaption>{html.escape(label)}</figcaption></figure>" for picture, label in block.items)
            parts.append(f'<div class="pictures" style="--columns:{block.columns}">{items}</div>'
                         f'<p class="caption">{_inline(block.caption)}</p>')
        else:
            parts.append(f'<div class="plot">{_svg(block.figure)}</div><p class="caption">{_inline(block.caption)}</p>')
    return "".join(parts) + "</section>"


def _table_html(table: Table) -> str:
    def cell(value: Cell) -> str:
        kind = {Printed: "printed", Best: "best"}.get(type(value), "" if isinstance(value, str) else "number")
        return f'<td class="{kind}">{_inline(shown(value))}</td>' if kind else f"<td>{_inline(shown(value))}</td>"

    head = "".join(f"<th>{_inline(name)}</th>" for name in table.head)
    rows = "".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in table.rows)
    return (f'<p class="caption">{_inline(table.caption)}</p><div class="table"><table><thead><tr>{head}</tr></thead>'
            f"<tbody>{rows}</tbody></table></div>")


def _prose(text: str) -> str:
    parts = []
    for paragraph in text.strip().split("\n\n"):
        lines = paragraph.splitlines()
        if lines[0].startswith("- "):
            items = ("\n" + paragraph).split("\n- ")[1:]
            parts.append("<ul>" + "".join(f"<li>{_inline(item)}</li>" for item in items) + "</ul>")
        elif lines[0].startswith("### "):
            parts.append(f"<h3>{_inline(lines[0][4:])}</h3>")
        else:
            parts.append(f"<p>{_inline(paragraph)}</p>")
    return "".join(parts)


def _inline(text: str) -> str:
    text = html.escape(text, quote=False)
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    text = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", text)
    return re.sub(r"(?<![*\w])\*([^*]+)\*(?![*\w])", r'<span class="printed">\1</span>', text)


def _webp(picture: np.ndarray) -> str:
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "WEBP", quality=82, method=4)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg")
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def _markdown(folder: Path, title: str, lead: str, sections: Sequence[Section]) -> str:
    images = folder / "images"
    images.mkdir(exist_ok=True)
    for old in images.glob("papers-*"):
        old.unlink()
    parts = [f"# {title}", lead.strip()]
    number = 0
    for section in sections:
        parts.append(f"## {section.title}")
        parts += [f"**Not here:** {problem}" for problem in section.problems]
        for block in section.blocks:
            if isinstance(block, str):
                parts.append(block.strip())
            elif isinstance(block, Table):
                parts += [block.caption, _table_markdown(block)]
            else:
                number += 1
                name = f"papers-{number:02d}.{'png' if isinstance(block, Plot) else 'jpg'}"
                if isinstance(block, Plot):
                    block.figure.savefig(images / name, dpi=80)
                else:
                    strip(block).save(images / name, quality=74, optimize=True)
                parts += [f"![{re.sub(r'[*`]', '', block.caption)}](images/{name})", block.caption]
    return "\n\n".join(parts) + "\n"


def _table_markdown(table: Table) -> str:
    def cell(value: Cell) -> str:
        text = shown(value).replace("|", "\\|")
        return f"*{text}*" if isinstance(value, Printed) else f"**{text}**" if isinstance(value, Best) else text

    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(cells) + " |"

    align = ["---" if not table.rows or isinstance(table.rows[0][place], str) else "---:"
             for place in range(len(table.head))]
    return "\n".join([line(table.head), line(align), *(line(map(cell, row)) for row in table.rows)])


def strip(pictures: Pictures) -> Image.Image:
    """Return pictures side by side as one, each with its line."""
    columns = min(pictures.columns, len(pictures.items))
    ratio = max(picture.shape[0] / picture.shape[1] for picture, _ in pictures.items)
    side = SMALL // max(columns, 3)
    high, line = round(side * ratio), 26
    rows = -(-len(pictures.items) // columns)
    whole = Image.new("RGB", (side * columns, rows * (high + line)), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.truetype(findfont("DejaVu Sans"), 15)
    for number, (picture, label) in enumerate(pictures.items):
        left, top = number % columns * side, number // columns * (high + line)
        tall = round(side * picture.shape[0] / picture.shape[1])
        whole.paste(Image.fromarray(picture).resize((side, tall), Image.Resampling.LANCZOS), (left, top))
        pen.text((left + side / 2, top + high + 4), label, fill=(40, 48, 60), font=font, anchor="ma")
    return whole


STYLE = """
:root{--ink:#1d2733;--soft:#5b6878;--line:#dde3ea;--printed:#2456b8;--back:#fff}
*{box-sizing:border-box}body{margin:0;font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;
color:var(--ink);background:var(--back)}
header,main{max-width:1240px;margin:0 auto;padding:0 28px}header{padding-top:36px}
h1{font-size:2.1rem;line-height:1.2;margin:0 0 .5rem}h2{font-size:1.5rem;margin:3.2rem 0 .6rem;padding-top:.8rem;
border-top:2px solid var(--ink)}h3{font-size:1.1rem;margin:1.8rem 0 .4rem}p,ul{max-width:82ch}
nav{position:sticky;top:0;background:#fffffff2;border-block:1px solid var(--line);padding:8px 28px;margin-top:20px;
display:flex;flex-wrap:wrap;gap:4px 18px;font-size:.88rem;z-index:1;justify-content:center}
nav a{color:var(--soft);text-decoration:none}nav a:hover{color:var(--ink);text-decoration:underline}
section{scroll-margin-top:60px}code{font-size:.9em;background:#f1f4f7;padding:.05em .3em;border-radius:3px}
.table{overflow-x:auto;margin:.4rem 0 1.4rem}table{border-collapse:collapse;font-size:.9rem;
font-variant-numeric:tabular-nums}th{text-align:right;font-weight:600;border-bottom:1.5px solid var(--ink);
padding:.25rem .7rem;vertical-align:bottom}td{text-align:right;padding:.2rem .7rem;border-bottom:1px solid var(--line);
white-space:nowrap}th:first-child,td:first-child{text-align:left;padding-left:0}
td:not([class]){text-align:left}tbody tr:hover{background:#f6f8fa}
.printed{color:var(--printed);font-style:italic}.best{font-weight:700}
.caption{color:var(--soft);font-size:.92rem;margin:.9rem 0 .3rem}
.pictures{display:grid;grid-template-columns:repeat(var(--columns),minmax(0,1fr));gap:12px;margin:1rem 0 .2rem;
align-items:start}
.pictures figure{margin:0;background:#f8fafc;border:1px solid var(--line);border-radius:6px;overflow:hidden}
.pictures img{display:block;width:100%;height:auto}
.pictures figcaption{font-size:.85rem;text-align:center;padding:.35rem .4rem;border-top:1px solid var(--line)}
.plot svg{max-width:100%;height:auto}
.problem{background:#fff4e5;border-left:4px solid #e08a00;padding:.5rem .9rem}
@media(max-width:760px){.pictures{grid-template-columns:repeat(2,minmax(0,1fr))}}
@media print{nav{display:none}section{break-inside:auto}}
"""
