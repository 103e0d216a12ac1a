# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of the web client, by the name under which a server gives them out."""

from pathlib import Path

CLIENT = Path(__file__).parent / "client"
# What is not in this list is never given out.
FILES = {
    **dict.fromkeys(("index.html", "panel.html"), "text/html; charset=utf-8"),
    **dict.fromkeys(
        ("viewer.js", "panel.js", "view.js", "orbit.js", "worker.js", "stream.js", "line.js",
         "container.js", "mesh.js", "batch.js", "fan.js", "positions.js", "coder.js", "columns.js", "hash.js",
         "finest.js", "picture.js", "three.module.js", "three.core.js"),
        "text/javascript; charset=utf-8",
    ),
    "three.LICENSE": "text/plain; charset=utf-8",
}
