# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels as text, such as "0.5, 0.25": what operators take, and what the panel shows as rows."""

from collections.abc import Sequence
from math import isfinite

from ..core.errors import MeshError

# The property that holds the text of each kind of levels.
TEXT_OF = {"ratio": "ratios", "count": "faces_targets", "error": "max_errors", "screen": "screen_sizes",
           "budget": "budgets"}  # fmt: skip
_COUNTS = {"count", "budget"}


def read_levels(kind: str, text: str) -> list[float]:
    """Read the numbers of a text.

    Raises
    ------
    MeshError
        There are none, or something else stands there.
    """
    try:
        values = [float(int(word)) if kind in _COUNTS else float(word) for word in words_of(text)]
    except (ValueError, OverflowError):
        values = []
    if not values or not all(map(isfinite, values)):
        example = "8000, 2000, 500" if kind in _COUNTS else "0.5, 0.25, 0.1"
        raise MeshError(f"levels '{text}' cannot be read: write numbers with commas between, such as {example}")
    return values


def words_of(text: str) -> list[str]:
    """Split a text into what should be its numbers."""
    return text.replace(";", ",").replace(",", " ").split()


def written(kind: str, values: Sequence[float]) -> str:
    """Write numbers as text."""
    return ", ".join(f"{value:.6g}" if kind in {"ratio", "error"} else str(round(value)) for value in values)
