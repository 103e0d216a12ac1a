# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work as generators: they yield how far they are, return their result, and may be closed at any time."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

Value = TypeVar("Value")


def run_to_end(steps: Generator[Any, None, Value]) -> Value:
    """Run the steps and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def scaled(steps: Generator[Any, None, Value], scale: Any) -> Generator[float, None, Value]:  # noqa: ANN401 - mypy: defaults of lambdas
    """Yield a function of what the steps yield; returns their result."""
    while True:
        try:
            yield scale(next(steps))
        except StopIteration as end:
            return end.value
