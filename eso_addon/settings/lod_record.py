# SPDX-License-Identifier: GPL-3.0-or-later
"""How levels were made, as plain data that is stored with them and makes them again."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from ..core.chains import Goals
from ..core.mesh import MeshError
from ..core.options import Options, options_of
from ..core.screen import Screen


@dataclass(frozen=True)
class LodSettings:
    """How levels are made.

    Attributes
    ----------
    kind, values
        As of `Goals`.
    screen
        Fields of `Screen`.
    engine
        What `simplify` takes besides a target.
    apply_modifiers
        Whether the meshes have the modifiers in them.
    live
        Kinds of modifiers that stay live nevertheless.
    profile
        A key of `PROFILES`.
    group
        The vertex group that protects or favours, and how; empty for none.
    writing
        Options of `write_mesh`.
    """

    kind: str
    values: Sequence[float]
    screen: Mapping[str, Any]
    engine: Mapping[str, Any]
    apply_modifiers: bool
    live: Sequence[str]
    profile: str
    group: Mapping[str, Any] = field(default_factory=dict)
    writing: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, data: Mapping[str, Any] | None) -> "LodSettings":
        """Make settings from what was stored.

        Raises
        ------
        MeshError
            What was stored is not of this version.
        """
        try:
            return cls(**(data or {}))
        except TypeError:
            raise MeshError("these levels do not say how they were made: generate them anew") from None

    def stored(self, counts: Sequence[int], *, with_group: bool = True) -> dict[str, Any]:
        """Give the settings for one mesh to be stored; of a budget, its share; the group only if the mesh has it."""
        data = asdict(self) if with_group else asdict(self) | {"group": {}}
        return data | {"kind": "count", "values": list(counts)} if self.kind == "budget" else data

    def goals(self) -> Goals:
        """Give the goals of the levels."""
        return Goals(self.kind, list(self.values), Screen(**self.screen))

    def options(self, carried: Mapping[str, Any]) -> Options:
        """Give the engine's options for a mesh that carries attributes."""
        engine = {**self.engine, **carried}
        return options_of(engine.pop("preset", "default"), engine)


def ordered_goals(kind: str, goals: list[float]) -> list[float]:
    """Put levels in order, the finest first.

    Raises
    ------
    MeshError
        Two levels are the same.
    """
    ordered = sorted(goals, reverse=kind != "error")
    for finer, coarser in zip(ordered, ordered[1:], strict=False):
        if finer == coarser:
            raise MeshError(f"level {finer:g} is there twice: each level must be coarser than the one before")
    return ordered
