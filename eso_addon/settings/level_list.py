# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The levels as a list to click on: each row is a view of one number in the text that the operators take."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import bpy
from bpy.props import FloatVectorProperty, IntVectorProperty

MOST = 8  # rows; a text may have more numbers, which then stand in the text alone
_TEXT_OF = {"ratio": "ratios", "count": "faces_targets", "error": "max_errors", "screen": "screen_sizes",
            "budget": "budgets"}  # fmt: skip
# How the next level follows from the last one.
_STEP = {"ratio": 0.5, "count": 0.5, "error": 3.0, "screen": 0.5, "budget": 0.5}
_LARGEST = 2**31 - 1  # that Blender's integers hold


def _words(text: str) -> list[str]:
    """Split a list into its words, as far as they are numbers."""
    return [word for word in text.replace(";", ",").replace(",", " ").split() if _is_number(word)]


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def numbers(text: str) -> list[float]:
    """Read the numbers of a list, as far as they are some."""
    return [float(word) for word in _words(text)]


def written(values: Sequence[float], *, whole: bool) -> str:
    """Write numbers as a list."""
    return ", ".join(str(round(value)) if whole else f"{value:.6g}" for value in values)


def _view(kind: str) -> dict[str, Callable[..., Any]]:
    """Give the functions that read and write one kind's text as a row of numbers."""
    name, whole = _TEXT_OF[kind], kind in {"count", "budget", "screen"}

    def shown(values: Sequence[float]) -> list[float]:
        return [min(max(round(value), -_LARGEST), _LARGEST) if whole else value for value in values[:MOST]]

    def get(self: Any) -> list[float]:  # noqa: ANN401 - the settings
        found = shown(numbers(getattr(self, name)))
        return found + [0 if whole else 0.0] * (MOST - len(found))

    def put(self: Any, values: Sequence[float]) -> None:  # noqa: ANN401
        words = _words(getattr(self, name))
        before = shown([float(word) for word in words])
        # What was not changed stays as it is written: a row may not show all of it.
        rows = [word if math.isclose(old, new, rel_tol=1e-6) else written([new], whole=whole)
                for word, old, new in zip(words, before, values, strict=False)]
        setattr(self, name, ", ".join([*rows, *words[MOST:]]))

    return {"get": get, "set": put}


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
        """Give the numbers of the levels, as they stand in the list."""
        return numbers(getattr(self, _TEXT_OF[self.levels_by]))

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
        whole = self.levels_by in {"count", "budget", "screen"}
        setattr(self, _TEXT_OF[self.levels_by], written([max(value, 1) if whole else value for value in values],
                                                        whole=whole))  # fmt: skip

    def draw_rows(self, layout: bpy.types.UILayout, told: Sequence[str]) -> None:
        """Draw a row for each level: its name, its number, and what is told of it."""
        count = len(self.level_values())
        for index in range(min(count, MOST)):
            row = layout.row(align=True)
            split = row.split(factor=0.55, align=True)
            split.prop(self, f"row_{self.levels_by}", index=index, text=f"LOD{index}")
            split.label(text=told[index] if index < len(told) else "")
        if count > MOST:
            layout.label(text=f"+ {count - MOST}", translate=False)
