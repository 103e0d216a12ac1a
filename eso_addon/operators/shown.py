# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport shows over the scene: the colours of one object, with a legend, and lines. `ui` draws it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import bpy
from bpy.app.handlers import persistent

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

@dataclass(eq=False)
class Overlay:
    """What is shown of an object.

    Attributes
    ----------
    kind : str
        What asked for it, such as ``"weights"``.
    name : str
        The object whose place it takes.
    vertices : ndarray, (n, 3) float32
        In the object's space.
    faces : ndarray, (m, 3) int32
    colors : ndarray, (n, 4) float32, or None
        None: the object's faces in one colour.
    lines : list of tuple
        Label, colour (4 floats), and vertices (l, 2, 3) float32 of segments.
    title, low, high : str
        The legend: what the colours mean, and the figures at both ends.
    cache : dict
        Of the one that draws.
    """

    kind: str
    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colors: NDArray[np.float32] | None = None
    lines: list[tuple[str, tuple[float, float, float, float], NDArray[np.float32]]] = field(default_factory=list)
    title: str = ""
    low: str = ""
    high: str = ""
    cache: dict[str, Any] = field(default_factory=dict)


_now: list[Overlay] = []


def show(overlay: Overlay) -> None:
    """Show this, and nothing else."""
    _now[:] = [overlay]
    redraw()


def hide() -> None:
    """Show nothing."""
    _now.clear()
    redraw()


def shown() -> Overlay | None:
    """Give what is shown."""
    return _now[0] if _now else None


def is_shown(kind: str, obj: bpy.types.Object | None) -> bool:
    """Tell whether this is shown of an object."""
    return obj is not None and any(overlay.kind == kind and overlay.name == obj.name for overlay in _now)


def redraw() -> None:
    """Ask every viewport to draw itself."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def _forget(*_: object) -> None:
    _now.clear()


def register() -> None:
    """Forget what is shown when another file is loaded."""
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    """Show nothing any more."""
    _now.clear()
    if _forget in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(_forget)
