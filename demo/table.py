# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of measured errors."""

from collections.abc import Sequence

from eso_addon import Deviation

_COLUMNS = (
    "triangles",
    "ours: maximum",
    "from the original",
    "to the original",
    "mean",
    "Decimate: triangles",
    "maximum",
    "mean",
    "paper: maximum",
)


def markdown_table(
    ours: Sequence[tuple[int, Deviation]], decimate: Sequence[tuple[int, Deviation]], paper: Sequence[float]
) -> str:
    """Lay out the deviations of each level, all relative to the diagonal of the bounding box.

    Parameters
    ----------
    ours, decimate
        Triangles and deviation of each level.
    paper
        The maximum that the paper prints for each level.

    Returns
    -------
    str
        Markdown that reads well in a terminal too.
    """
    rows = [_COLUMNS]
    for (count, our), (other_count, other), printed in zip(ours, decimate, paper, strict=True):
        lengths = (our.symmetric.maximum, our.forward.maximum, our.backward.maximum, our.symmetric.mean)
        rows.append(
            (
                str(count),
                *(f"{length / our.diagonal:.5f}" for length in lengths),
                str(other_count),
                f"{other.symmetric.maximum / other.diagonal:.5f}",
                f"{other.symmetric.mean / other.diagonal:.5f}",
                f"{printed:.5f}",
            )
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = [[cell.rjust(width) for cell, width in zip(row, widths, strict=True)] for row in rows]
    lines = [f"| {' | '.join(row)} |" for row in padded]
    lines.insert(1, "|" + "|".join("-" * (width + 1) + ":" for width in widths) + "|")
    return "\n".join(lines) + "\n"
