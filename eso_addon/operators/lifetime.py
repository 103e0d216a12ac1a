# SPDX-License-Identifier: GPL-3.0-or-later
"""Ends the engine's threads when a file is loaded and when the add-on goes."""

import bpy
from bpy.app.handlers import persistent

from ..jobs import replay
from ..jobs.worker import stop_all


@persistent
def stop_before_load(*_: object) -> None:
    """Join the threads and forget the last run: what they read belongs to the file that goes."""
    stop_all()
    replay.forget()


def register() -> None:
    """Listen for files being loaded."""
    bpy.app.handlers.load_pre.append(stop_before_load)


def unregister() -> None:
    """Join the threads, forget the last run, and listen no more."""
    stop_before_load()
    if stop_before_load in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(stop_before_load)
