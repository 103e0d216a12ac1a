# SPDX-License-Identifier: GPL-3.0-or-later
"""The process in which a batch's worker has its files worked off: `lod` on one after another, asked in JSON."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Run one request.

    Parameters
    ----------
    request
        What `lod` was given on the command line, with the paths "input" and "output"; or a "sheet" of pictures.

    Returns
    -------
    dict
        What `lod` writes with `--json`, or "error", one line.
    """
    from . import cli

    if "sheet" in request:
        return _draw(request)
    said = io.StringIO()
    with tempfile.TemporaryDirectory(prefix="eso_lod_") as folder:
        figures = Path(folder) / "figures.json"
        paths = {"input": Path(request["input"]), "output": Path(request["output"]), "json": figures}
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
                code = cli.carry_out(argparse.Namespace(**{**request, **paths}, run=cli.run_lod))
        except Exception as error:  # a fault of ours in one file must not end the batch
            return {"error": " ".join(f"{type(error).__name__}: {error}".split())}
        if code:
            return {"error": said.getvalue().strip().removeprefix("eso_lod: ")}
        return json.loads(figures.read_text(encoding="utf-8"))


def _draw(request: dict[str, Any]) -> dict[str, Any]:
    try:
        from .bridge.contact_sheet import contact_sheet

        contact_sheet(Path(request["sheet"]), [Path(name) for name in request["meshes"]], request["labels"])
    except Exception as error:  # without Blender there is a table and no picture
        return {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    return {}


if __name__ == "__main__":
    from .farm.serving import serve

    serve(answer)
