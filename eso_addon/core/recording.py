# SPDX-License-Identifier: GPL-3.0-or-later
"""A run of the engine kept with the mesh that it ran on, so that further levels cost no further run."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .blocks import Blocks
from .carrier import Carrier
from .collapse import collapse_steps
from .error_limit import within
from .feature_collapse import guide_for
from .guidance import guidance_of
from .levels import Mesh, SimplifyResult, in_input_units, judge_count, level, spare_of
from .options import Options
from .prepare import Prepared, prepare
from .record import CollapseRecord
from .steps import scaled
from .symmetry import mirror_of
from .weigh import initial_quadrics


@dataclass(frozen=True, eq=False)
class Recording:
    """What one run of the engine did, and to what.

    Attributes
    ----------
    mesh : Prepared
    record : CollapseRecord
        In the input's units.
    original : tuple of ndarray
        Vertices (n, 3) float64 and faces (m, 3) int64 as they were given.
    options : Options
    carrier : Carrier, optional
        Puts on the levels what the mesh carries.
    """

    mesh: Prepared
    record: CollapseRecord
    original: Mesh
    options: Options
    carrier: Carrier | None = None

    def levels_steps(self, counts: Sequence[int], errors: Sequence[float], *,
                     refit: bool | None = None) -> Generator[float, None, list[SimplifyResult]]:
        """Make levels of these counts of triangles, or within these errors; yields the part that is done.

        Parameters
        ----------
        counts, errors
            One of both is empty.
        refit : bool, optional
            In place of the option.
        """
        options = self.options if refit is None else replace(self.options, refit=refit)
        results: list[SimplifyResult] = []
        for count in counts:
            results.append(judge_count(self._level(count, options), count, options))
            yield len(results) / len(counts)
        for error in errors:
            results.append(within(self.mesh, self.record, self.original, error, options, self.carrier))
            yield len(results) / len(errors)
        return results

    def _level(self, count: int, options: Options) -> SimplifyResult:
        """Return the level of so many triangles: of fewer, with vertices put back, or as it is where too few can be."""
        spare = spare_of(count, options, self.carrier) if count < self.record.faces_before else 0
        length = self.record.length_for(count - 2 * spare)
        spare = min(spare, max(count - self.record.left(length), 0) // 2)
        result = level(self.mesh, self.record, self.original, length, options, self.carrier, spare)
        if spare and len(result.faces) < count - 1:
            length = self.record.length_for(count)
            result = level(self.mesh, self.record, self.original, length, options, self.carrier)
        return result


def recording_steps(original: Mesh, options: Options, least: int) -> Generator[float, None, Recording]:
    """Run the engine on a checked mesh down to so many triangles; yields progress from 0 to 1, may be closed.

    Parameters
    ----------
    original : tuple of ndarray
        Vertices (n, 3) float64 and faces (m, 3) int64.
    options : Options
    least : int
        Triangles of the coarsest level that is wanted.
    """
    vertices, faces = original
    mirror = mirror_of(vertices, faces, options.symmetry) if options.symmetry != "none" else None
    rest = 0 if mirror is None else len(mirror.rest)
    if mirror is not None:
        faces, least = faces[mirror.half], max((least - rest) // 2, 0)
    mesh = prepare(vertices, faces, join=options.weld, prune=options.prune)
    blocks = Blocks(options.threads, mesh.faces.shape[1])
    try:
        yield 0.02
        guidance = guidance_of(mesh, original, options, mirror)
        guide = guide_for(mesh, options, guidance.edges) if options.method == "feature" else None
        quadrics = initial_quadrics(mesh, options, guidance)
        yield 0.12
        # further than asked: a refit puts vertices back
        spare = spare_of(least, options, guidance.carrier)
        last = max(least - 2 * (spare + 1), 0) if spare else least
        run = collapse_steps(mesh.points, mesh.faces, quadrics, mesh.opened, guidance.locked, last, options.rules,
                             blocks, guide)
        total = max(mesh.faces.shape[1] - last, 1)
        record = yield from scaled(run, lambda left: 0.12 + 0.88 * (1 - (left - last) / total))
    finally:
        blocks.close()
    some = int(np.count_nonzero(record.faces_left))  # where nothing guards the topology, all may go: that is no mesh
    record = in_input_units(record.first(some), mesh, vertices)
    if mirror is not None:  # each collapse stands for two
        record = replace(record, faces_before=2 * record.faces_before + rest,
                         faces_left=2 * record.faces_left + rest)
    return Recording(mesh, record, original, options, guidance.carrier)
