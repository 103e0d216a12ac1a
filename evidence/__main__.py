# SPDX-License-Identifier: GPL-3.0-or-later
"""The papers again: `python -m evidence [--models DIR]` writes out/papers/index.html, papers.md and papers.json."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import machine

from . import ablation, distances, moving, preserved, reconstruction, streams, variation
from .cases import Pool
from .context import Context
from .models import find_models
from .page import Section, write

TITLE = "The papers again"
SECTIONS: dict[str, Callable[[Context], Section]] = {
    "Moving lengths": moving.section,
    "Deviation": distances.section,
    "Surface variation": variation.section,
    "What is preserved": preserved.section,
    "The second paper's Table 1": streams.section,
    "Levels of a stream": reconstruction.levels_section,
    "A subdivided mesh": reconstruction.subdivision_section,
    "Ablation": ablation.section,
}


def main(words: Sequence[str] | None = None) -> int:
    """Make the page; return 0, or 1 where some of it could not be made."""
    parser = argparse.ArgumentParser(prog="python -m evidence", description=__doc__)
    folder = os.environ.get("MODELS") or None
    parser.add_argument("--models", type=Path, default=folder, help="folder with the papers' models (default: $MODELS)")
    parser.add_argument("--out", type=Path, default=Path("out/papers"), help="(default: out/papers)")
    parser.add_argument("--docs", type=Path, help="put papers.md and its pictures there too")
    parser.add_argument("--short", action="store_true", help="the cow alone, at two levels")
    told = parser.parse_args(words)
    if told.models is not None and not Path(told.models).is_dir():
        parser.error(f"{told.models} is not a folder: give one with the papers' models, or leave MODELS out")
    start = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - start:5.0f} s] {text}", flush=True)

    status = run(told.models and Path(told.models), told.out, say, short=told.short)
    if told.docs:
        told.docs.mkdir(parents=True, exist_ok=True)
        shutil.copy(told.out / "papers.md", told.docs)
        shutil.copytree(told.out / "images", told.docs / "images", dirs_exist_ok=True)
    return status


def run(folder: Path | None, out: Path, say: Callable[[str], None], *, short: bool = False) -> int:
    """Run every section and write the page; a section that fails is named there, and the rest is there."""
    models, missing = find_models(folder)
    for name, model in list(models.items()):
        try:
            if not model.triangles:
                raise ValueError("it has no faces")
        except Exception as error:  # a file that cannot be read is as good as missing
            missing[name] = f"{type(error).__name__}: {error}"
            del models[name]
    if "cow" not in models:
        say("the cow is not at hand: pymeshlab, in whose wheel it is, is not installed")
        return 1
    if short:
        models, missing = {"cow": models["cow"]}, {}
    say(f"{len(models)} models: {', '.join(models)}" + (f"; not at hand: {', '.join(missing)}" if missing else ""))
    out.mkdir(parents=True, exist_ok=True)
    sections: list[Section] = []
    failures = 0
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as store:
        pool = Pool(Path(store), say)
        try:
            context = Context(models, missing, pool, say, short)
            for number, (title, make) in enumerate(SECTIONS.items(), 1):
                say(f"{number} of {len(SECTIONS)}: {title}")
                try:
                    sections.append(make(context))
                    sections[-1].problems += context.troubles
                    context.troubles.clear()
                except Exception as error:  # named on the page, with where; the rest goes on
                    failures += 1
                    traceback.print_exc()
                    sections.append(Section(f"{number}. {title}", problems=[f"{type(error).__name__}: {error}"]))
        finally:
            pool.close()
    about = {**machine(), "seconds": round(time.monotonic() - begun), "models": {
        model.name: {"title": model.title, "triangles": model.triangles, "origin": model.origin}
        for model in models.values()}, "missing": missing}
    write(out, TITLE, _lead(about), sections)
    raw = {"about": about, **{section.anchor: section.raw for section in sections}}
    (out / "papers.json").write_text(json.dumps(_plain(raw), indent=1) + "\n", encoding="utf-8")
    say(f"wrote {out / 'index.html'}, papers.md and papers.json")
    return 1 if failures else 0


def _lead(about: dict[str, Any]) -> str:
    lines = [f"- {model['title']}: {model['triangles']:,} triangles, {model['origin']}"
             for model in about["models"].values()]
    text = (
        "Every table and figure of two papers that can be had, from one run of this product, beside what the papers "
        "print: Tseng and Lin, “3D Surface Simplification Based on Extended Shape Operator” (ESO), and Chen and "
        "Nishita, “An Efficient Mesh Simplification Method with Feature Detection for Unstructured Meshes and Web "
        "Graphics”.\n\n**How to read it.** Figures in *blue italics* are the papers' own, as printed; all others come "
        "from this run, none is typed in. `make papers` (with `MODELS=DIR` for more meshes) makes the page again; "
        f"`papers.json` beside it has the raw figures.\n\nThis run: {datetime.date.today():%d %B %Y}; "
        f"{about['machine']}; {about['versions']}; {about['seconds'] // 60} min {about['seconds'] % 60} s. Its meshes:"
    )
    text += "\n\n" + "\n".join(lines)
    if about["missing"]:
        text += "\n\n**Not at hand:** " + "; ".join(f"{name} ({why})" for name, why in about["missing"].items()) + "."
    return text


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return plain data for JSON: no numpy, no NaN."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


if __name__ == "__main__":
    sys.exit(main())
