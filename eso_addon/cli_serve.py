# SPDX-License-Identifier: GPL-3.0-or-later
"""The word `serve` of the command line."""

import argparse
import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any


def add_word(words: Any, stream_path: Callable[[str], Path]) -> None:  # noqa: ANN401 - argparse keeps the type to itself
    """Add the word to the parser; `stream_path` reads the file's name."""
    serve = words.add_parser("serve", help="show a stream in the browser",
                             description="Give out a stream and its page on this computer, until stopped with Ctrl+C.")
    serve.set_defaults(run=run)
    serve.add_argument("input", type=stream_path, metavar="IN", help="an .esopm file")
    serve.add_argument("--port", type=_port, default=0, metavar="N", help="any free one without")
    serve.add_argument("--host", default="127.0.0.1", metavar="ADDRESS",
                       help="listen here; on this computer alone without (0.0.0.0: everybody on the network)")
    serve.add_argument("--open", action="store_true", help="open the page in the browser")


def _port(word: str) -> int:
    if word.isascii() and word.isdigit() and int(word) < 1 << 16:
        return int(word)
    raise argparse.ArgumentTypeError(f"{word} is no port: give a number from 0 to 65535")


def run(args: argparse.Namespace) -> None:
    """Serve until interrupted."""
    from .viewer.server import MeshServer

    with MeshServer(args.input, args.port, args.host) as server:
        print(f"{args.input.name} at {server.url} (stop with Ctrl+C)", flush=True)
        if args.open:
            import webbrowser

            webbrowser.open(server.url)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
