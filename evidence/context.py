# SPDX-License-Identifier: GPL-3.0-or-later
"""What every section is given: the models, the processes, and the levels that several sections share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.readers import Mesh

from .cases import FOREIGN, VARIANTS, Level, Pool
from .models import Model
from .printed import DISTANCES, PERCENT
from .raster import Camera, render

ESO_MODELS = ("cow", "dragon", "femur", "isis")
SHORT = ("QEM", "CF", "ESO 3", "ESO default")
IN_PLACE = ("airplane", "bone")  # where only the cow of the paper's models is at hand


@dataclass
class Context:
    """The run: `short` means one model and two levels, for the test suite."""

    models: dict[str, Model]
    missing: dict[str, str]
    pool: Pool
    say: Callable[[str], None]
    short: bool = False
    failed: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)  # pictures that failed in the section that is being made
    _levels: dict[tuple[str, str, int], Level] = field(default_factory=dict)

    @property
    def percent(self) -> tuple[int, ...]:
        """The levels of Tables 1 to 10."""
        return (20, 10) if self.short else PERCENT

    @property
    def eso_models(self) -> list[Model]:
        """The ESO paper's models at hand, others where there are few."""
        names = [name for name in ESO_MODELS if name in self.models]
        if len(names) < 2 and not self.short:
            names += [name for name in IN_PLACE if name in self.models]
        return [self.models[name] for name in names]

    def lack(self, names: tuple[str, ...]) -> list[str]:
        """Return a line about the models that are not at hand."""
        lacking = [name for name in names if name in self.missing]
        return [f"{', '.join(lacking)}: not at hand (see the top)"] if lacking and not self.short else []

    def target(self, model: Model, percent: int) -> int:
        """Return the triangles of a level: the paper's own number where the model is the paper's."""
        if model.own and model.name in DISTANCES:
            return DISTANCES[model.name][percent][0]
        return model.triangles * percent // 100

    def picture(self, mesh: Mesh, camera: Camera, wide: int = 640, *, colors: np.ndarray | None = None,
                wire: bool = True) -> np.ndarray:
        """Render a mesh, small where the run is short; where that fails the page names it and shows a grey field."""
        wide = wide // 4 if self.short else wide
        try:
            return render(mesh, camera, wide, colors=colors, wire=wire)
        except Exception as error:
            self.troubles.append(f"a picture of {len(mesh[1]):,} triangles: {type(error).__name__}: {error}")
            return np.full((round(wide * camera.ratio), wide, 3), 200, np.uint8)

    def levels(self) -> dict[tuple[str, str, int], Level]:
        """Return the levels of the ESO paper's models by model, variant and percentage; made once."""
        if not self._levels:
            targets = {model.name: [self.target(model, percent) for percent in self.percent]
                       for model in self.eso_models}
            variants = {name: VARIANTS[name] for name in SHORT} if self.short else VARIANTS
            meshes = {model.name: model.mesh for model in self.eso_models}
            found, failed = self.pool.chains(meshes, variants, targets, () if self.short else FOREIGN)
            self.failed += failed
            for level in found:
                percent = self.percent[targets[level.model].index(level.target)]
                self._levels[level.model, level.variant, percent] = level
        return self._levels
