# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The levels as a list to click on: each row is a view of one number in the text that the operators take."""

from collections.abc import Callable, Sequence
from math import isclose
from typing import Any

import bpy
from bpy.props import FloatVectorProperty, IntVectorProperty

from ..core.errors import MeshError
from .level_text import TEXT_OF, read_levels, words_of, written

MOST = 8  # rows; a text may have more numbers, which then stand in the text alone
_LARGEST = 2**31 - 1  # that Blender's properties hold
# How the next level follows from the last one.
_STEP = {"ratio": 0.5, "count": 0.5, "error": 3.0, "screen": 0.5, "budget": 0.5}


def _view(kind: str) -> dict[str, Callable[..., Any]]:
    """Give the functions that read and write one kind's text as a row of numbers."""
    is_whole = kind not in {"ratio", "error"}

    def get(self: Any) -> list[float]:  # noqa: ANN401 - the settings
        found = [max(min(round(value), _LARGEST), -_LARGEST) if is_whole else value
                 for value in _shown(self, kind)[:MOST]]  # fmt: skip
        return found + [0 if is_whole else 0.0] * (MOST - len(found))

    def put(self: Any, values: Sequence[float]) -> None:  # noqa: ANN401
        words = words_of(getattr(self, TEXT_OF[kind])) if _shown(self, kind) else []
        # what was not changed stays as it is written: a row may not show all of it
        words[:MOST] = [word if isclose(old, new, rel_tol=1e-6) else written(kind, [new])
                        for word, old, new in zip(words, get(self), values, strict=False)]  # fmt: skip
        setattr(self, TEXT_OF[kind], ", ".join(words))

    return {"get": get, "set": put}


def _shown(settings: Any, kind: str) -> list[float]:  # noqa: ANN401 - the settings
    """Give the numbers of a text, none if it cannot be read: a panel draws whatever stands there."""
    try:
        return read_levels(kind, getattr(settings, TEXT_OF[kind]))
    except MeshError:
        return []


class LevelList:
    """Rows of levels; mixed into the settings beside `LodOptions`, whose texts they show."""

    row_ratio: FloatVectorProperty(
        name="Ratio", description="Share of the triangles at this level", size=MOST, min=0.0, max=1.0, precision=3,
        subtype="NONE", **_view("ratio"),
    )  # fmt: skip
    row_count: IntVectorProperty(
        name="Triangles", description="Triangles of this level", size=MOST, min=0, **_view("count")
    )
    row_error: FloatVectorProperty(
        name="Error", description="Largest deviation of this level, in the scene's units", size=MOST, min=0.0,
        precision=5, **_view("error"),
    )  # fmt: skip
    row_screen: IntVectorProperty(
        name="Size", description="Size on screen in pixels where this level begins", size=MOST, min=0,
        **_view("screen"),
    )  # fmt: skip
    row_budget: IntVectorProperty(
        name="Triangles in All", description="Triangles of all meshes together at this level", size=MOST, min=0,
        **_view("budget"),
    )  # fmt: skip

    levels_by: str

    def level_values(self) -> list[float]:
        """Give the numbers of the levels, none if they cannot be read."""
        return _shown(self, self.levels_by)

    def add_level(self) -> None:
        """Add a level after the last one, coarser than that."""
        values = self.level_values()
        last = values[-1] if values else (0.01 if self.levels_by == "error" else 1.0)
        if len(values) < MOST:
            self._put([*values, last * _STEP[self.levels_by]])

    def remove_level(self) -> None:
        """Remove the last level, but for the only one."""
        self._put(self.level_values()[:-1] or self.level_values())

    def _put(self, values: Sequence[float]) -> None:
        kind = self.levels_by
        least = 0.0 if kind in {"ratio", "error"} else 1.0
        setattr(self, TEXT_OF[kind], written(kind, [max(value, least) for value in values]))

    def draw_rows(self, layout: bpy.types.UILayout, told: Sequence[str]) -> None:
        """Draw a row for each level: its name, its number, and what is told of it; the text where it cannot be read."""
        count = len(self.level_values())
        if not count:
            layout.alert = True
            layout.prop(self, TEXT_OF[self.levels_by])
        for index in range(min(count, MOST)):
            row = layout.row(align=True)
            split = row.split(factor=0.55, align=True)
            split.prop(self, f"row_{self.levels_by}", index=index, text=f"LOD{index}")
            split.label(text=told[index] if index < len(told) else "")
        if count > MOST:
            layout.label(text=f"+ {count - MOST}", translate=False)
