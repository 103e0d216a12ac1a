# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender without its chatter; needs no Blender itself, so that it can be imported quietly."""

import ctypes
import io
import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout

from ..files.off import FileFormatError


@contextmanager
def quiet(trouble: str) -> Iterator[None]:
    """Keep Blender's chatter off the terminal, and turn its errors into one line that begins with the trouble."""
    silent = os.open(os.devnull, os.O_WRONLY)
    _flush()
    kept = {fd: os.dup(fd) for fd in (1, 2)}
    try:
        for fd in kept:
            os.dup2(silent, fd)
        # Python's own streams may stand for something else than the process's.
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except RuntimeError as error:
        raise FileFormatError(f"{trouble}: {_last_word(str(error))}") from error
    finally:
        _flush()
        for fd, copy in kept.items():
            os.dup2(copy, fd)
            os.close(copy)
        os.close(silent)


def need_blender() -> None:
    """Start Blender's module, quietly.

    Raises
    ------
    ValueError
        It is not there.
    """
    try:
        with quiet("cannot start Blender"):
            import bpy  # noqa: F401 - only whether it is there
    except ImportError as error:
        raise ValueError(f"only .off files work without Blender's module: pip install bpy ({error})") from None


def _flush() -> None:
    """Empty Python's and C's buffers, so that nothing comes out late."""
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)


def _last_word(message: str) -> str:
    """Take the line that says what happened: the exception of a traceback, or else the first one."""
    lines = [line.strip() for line in message.splitlines() if line.strip()] or ["Blender does not say why"]
    exceptions = re.findall(r"^[\w.]*(?:Error|Exception)\b.*", message, flags=re.MULTILINE)
    return exceptions[-1] if "Traceback" in message and exceptions else lines[0].removeprefix("Error: ")
