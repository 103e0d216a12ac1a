# SPDX-License-Identifier: GPL-3.0-or-later
"""The process in which a batch's worker has its files worked off: `lod` on one after another, asked in JSON."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
import tempfile
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO


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


def serve(requests: Iterable[bytes], answers: BinaryIO) -> None:
    """Answer each line by a line."""
    for line in requests:
        answers.write((json.dumps(answer(json.loads(line))) + "\n").encode())
        answers.flush()


def _requests() -> Iterable[bytes]:
    """Give the lines of standard input; the process ends with it, in the middle of a file too."""
    import queue

    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def listen() -> None:
        for line in sys.stdin.buffer:
            lines.put(line)
        os._exit(1)  # whoever wanted the answer is gone

    threading.Thread(target=listen, daemon=True).start()
    while True:
        yield lines.get()


if __name__ == "__main__":
    own = os.fdopen(os.dup(1), "wb")  # what Blender prints must not stand between the answers
    os.dup2(2, 1)
    serve(_requests(), own)
