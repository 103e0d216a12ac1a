# SPDX-License-Identifier: GPL-3.0-or-later
"""Engine profiles: how game engines want the levels of an LOD chain to be named. Data, no Blender."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Profile:
    """How an engine names levels.

    Attributes
    ----------
    label
        For people.
    suffixes
        What follows the object's name, finest level first; empty if every level has its index, `_LOD0`, `_LOD1`, ….
    most_levels
        How many levels the engine takes; None if it does not mind.
    """

    label: str
    suffixes: tuple[str, ...] = ()
    most_levels: int | None = None

    def name(self, base: str, level: int) -> str:
        """Name a level, 0 being the finest."""
        return base + (self.suffixes[level] if self.suffixes else f"_LOD{level}")


PROFILES = {
    "plain": Profile("Plain"),
    "unity": Profile("Unity", most_levels=8),
    "unreal": Profile("Unreal Engine", most_levels=8),
    "godot": Profile("Godot"),
    "gltf": Profile("glTF (MSFT_lod)"),
    # Second Life counts from the coarsest, and its finest has no suffix.
    "secondlife": Profile("Second Life", suffixes=("", "_LOD2", "_LOD1", "_LOD0"), most_levels=4),
}
