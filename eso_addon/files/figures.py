# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of a run as a JSON file."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .atomic import atomic_output


def write_figures(path: Path, figures: Mapping[str, Any]) -> None:
    """Write plain data to a file that appears whole or not at all."""
    with atomic_output(path) as draft:
        draft.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
