# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user may ask of the simplifier: options, presets and targets, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .attributes import Attribute
from .engine_state import Rules
from .mesh import MeshError
from .variation import METHODS as WEIGHTS

METHODS = (*WEIGHTS, "feature")
LINES = ("kept", "locked", "ignored")


@dataclass(frozen=True)
class Options:
    """How to simplify; the defaults are the best that was measured.

    Attributes
    ----------
    method : str
        Vertex weights: "eso" (Equation 8), "so" (Equation 7), "qem" (none), or "cf" (edge factor of Equation 5).
        "feature" (Chen and Nishita) has none: see `feature_collapse`; its survivors stay where they are.
    epsilon : float, optional
        For "feature": edges whose virtual edge weighs less, from -1 to 1, are held; without it none is.
    sharp_angle : float, optional
        For "feature": edges between faces further apart than so many degrees are sharp.
    sharp : array_like, (s, 2) int, optional
        For "feature": more sharp edges, as pairs of input vertices; `features.sharp_edges` finds those of attributes.
    rings : int
        Rings of "eso".
    placement : str
        "optimal", or "endpoint": half-edge collapse, survivors stay where they are.
    weight_power : float
        The weights enter the quadrics raised to this power,
    weight_floor : float
        but none counts for less than this part of the mean one.
    area_weighted : bool
        Weigh planes by their faces' areas; without it by one, as printed.
    boundary_weight : float
        Weight of the quadrics that hold open boundaries.
    memory, flip, share, spread, guard
        See `collapse.Rules`.
    weld : bool
        Treat vertices at equal positions as one, and hand them back split.
    prune : float
        Drop connected parts whose bounding box has a smaller diagonal, in the mesh's units.
    refit : bool
        Move the survivors afterwards so that the surface fits the original; only with optimal placement.
    flips : bool
        Let a refit flip edges too, where that brings the surface nearer.
    attributes : mapping of str to array_like or Attribute, optional
        What the mesh carries; see `attributes.check_attributes`.
    edges : array_like, (e, 2) int, optional
        The edges that attributes on edges belong to, as pairs of input vertices.
    seam_lines, material_lines, sharp_lines, boundary_lines : str
        What becomes of seams of UV and other values, borders of materials, sharp edges and open boundaries: "kept"
        (simplified along themselves, crossed last), "locked" (not touched) or "ignored".
    line_weight : float
        Weight of the quadrics that hold lines in their place.
    attribute_weight : float
        What UV maps, normals and colours count in the cost; one is as usual, nothing leaves them out.
    locked : array_like, (n,) bool, optional
        Vertices that neither go nor move.
    importance : array_like, (n,) float, optional
        What errors at each vertex count; one is as usual.
    symmetry : str
        "x", "y" or "z" for a symmetric result of a mesh that is symmetric across this axis, or "none".
    threads : int, optional
        Where not given, two for meshes of at least 200,000 triangles, else one. The result does not depend on it.
    """

    method: str = "eso"
    epsilon: float | None = None
    sharp_angle: float | None = None
    sharp: ArrayLike | None = None
    rings: int = 3
    placement: str = "optimal"
    weight_power: float = 0.5
    weight_floor: float = 0.3
    area_weighted: bool = True
    boundary_weight: float = 10.0
    memory: float = 1e-11
    flip: float = 0.5
    share: float = 0.5
    spread: float = 3.0
    guard: bool = True
    weld: bool = True
    prune: float = 0.0
    refit: bool = True
    flips: bool = True
    attributes: Mapping[str, ArrayLike | Attribute] | None = None
    edges: ArrayLike | None = None
    seam_lines: str = "kept"
    material_lines: str = "kept"
    sharp_lines: str = "kept"
    boundary_lines: str = "kept"
    line_weight: float = 5.0
    attribute_weight: float = 1.0
    locked: ArrayLike | None = None
    importance: ArrayLike | None = None
    symmetry: str = "none"
    threads: int | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise MeshError(f"unknown method {self.method!r}: choose one of {', '.join(METHODS)}")
        if self.placement not in ("optimal", "endpoint"):
            raise MeshError(f"unknown placement {self.placement!r}: choose optimal or endpoint")
        number("rings", self.rings, 1, 1000, whole=True)
        number("weight_power", self.weight_power, 0, 4)
        number("weight_floor", self.weight_floor, 0, 1)
        number("boundary_weight", self.boundary_weight, 0, 1e6)
        # less than this is lost in rounding, and flat regions could not be solved
        number("memory", self.memory, 1e-12, 1)
        number("flip", self.flip, -1, 1)
        number("share", self.share, 1e-6, 1)
        number("spread", self.spread, 1, np.inf)
        number("prune", self.prune, 0, np.inf)
        number("line_weight", self.line_weight, 0, 1e6)
        number("attribute_weight", self.attribute_weight, 0, 1e6)
        if self.symmetry not in ("none", "x", "y", "z"):
            raise MeshError(f"symmetry is {self.symmetry!r}: choose x, y, z or none")
        for name in ("seam_lines", "material_lines", "sharp_lines", "boundary_lines"):
            if getattr(self, name) not in LINES:
                raise MeshError(f"{name} is {getattr(self, name)!r}: choose one of {', '.join(LINES)}")
        if self.epsilon is not None:
            number("epsilon", self.epsilon, -1, 1)
        if self.sharp_angle is not None:
            number("sharp_angle", self.sharp_angle, 0, 180)
        if self.threads is not None:
            number("threads", self.threads, 1, 1024, whole=True)

    @property
    def moves(self) -> bool:
        """Whether survivors may move."""
        return self.placement == "optimal" and self.method != "feature"

    @property
    def rules(self) -> Rules:
        """What these options let the engine do."""
        rules = Rules(endpoint=not self.moves, memory=self.memory, flip=self.flip, guard=self.guard, share=self.share,
                      spread=self.spread, curvature_factor=self.method == "cf")
        # a weight renewed before each batch bears large ones: measured in docs/decisions/features.md
        return rules if self.method != "feature" else replace(
            rules, flip=0.2, guard=True, share=0.75, careful=1.0, few=2000, passes=2, spread=np.inf)


# the equations as printed: planes of weight one, weights once and to the first power, nothing held, edges only
PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "paper": {"weight_power": 1.0, "weight_floor": 0.0, "area_weighted": False, "boundary_weight": 0.0, "memory": 1e-9,
              "flip": 0.2, "share": 0.05, "guard": False, "refit": False},
}


def number(name: str, value: Any, low: float, high: float, *, whole: bool = False) -> float:  # noqa: ANN401
    """Return a value as a number between two bounds, or raise MeshError."""
    kind = "a whole number" if whole else "a number"
    bounds = f"of at least {low:g}" if high > 1e15 else f"from {low:g} to {high:g}"
    try:
        given = float(value)
    except (TypeError, ValueError):
        given = np.nan
    if not low <= given <= high or (whole and given != int(given)):
        raise MeshError(f"{name} is {value}: give {kind} {bounds}")
    return given


def options_of(preset: str, chosen: dict[str, Any]) -> Options:
    """Return a preset's options with some replaced."""
    if preset not in PRESETS:
        raise MeshError(f"unknown preset {preset!r}: choose one of {', '.join(PRESETS)}")
    unknown = sorted(set(chosen) - set(Options.__dataclass_fields__))
    if unknown:
        raise MeshError(f"unknown option {unknown[0]!r}: choose from {', '.join(Options.__dataclass_fields__)}")
    return Options(**{**PRESETS[preset], **chosen})


def targets_of(face_count: int, ratios: Sequence[float] | None, faces_targets: Sequence[int] | None,
               max_errors: Sequence[float] | None, *, needed: bool = True) -> tuple[list[int], list[float]]:
    """Return targets of one kind: as counts of faces, or as errors; a count of 0 where none is given nor needed."""
    given = [kind for kind in (ratios, faces_targets, max_errors) if kind is not None]
    if not given and not needed:
        return [0], []
    if len(given) != 1 or len(given[0]) == 0:
        raise MeshError("give one target: ratio, faces_target or max_error")
    if ratios is not None:
        for ratio in ratios:
            if not isinstance(ratio, int | float | np.number) or not 0 < ratio <= 1:
                raise MeshError(f"ratio is {ratio}: give a number above 0 and at most 1")
        return [max(round(face_count * float(ratio)), 1) for ratio in ratios], []
    if faces_targets is not None:
        return [int(number("faces_target", count, 1, 2.0**53, whole=True)) for count in faces_targets], []
    assert max_errors is not None
    return [], [number("max_error", error, 0, 1e300) for error in max_errors]
