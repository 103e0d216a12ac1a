# SPDX-License-Identifier: GPL-3.0-or-later
"""Has the engine's results probe their errors in the thread that made them, not in the window's."""

from collections.abc import Generator
from typing import TypeVar

from ..core.levels import SimplifyResult

Results = TypeVar("Results", SimplifyResult, list[SimplifyResult])


def with_errors(steps: Generator[float, None, Results]) -> Generator[float, None, Results]:
    """Run the steps, then let each result find its error, which it does when it is first asked."""
    results = yield from steps
    for result in [results] if isinstance(results, SimplifyResult) else results:
        yield 1.0
        _ = result.error
    return results
