# SPDX-License-Identifier: GPL-3.0-or-later
"""Engine profiles: how game engines want the levels of an LOD chain named and laid out. Data, no Blender."""

from typing import NamedTuple


class Profile(NamedTuple):
    """What an engine wants.

    Attributes
    ----------
    key
        The word for it on the command line.
    label
        For people.
    suffixes
        What follows the object's name, finest level first; empty if every level has its index, `_LOD0`, `_LOD1`, ….
    stand_in
        In a scene, what takes the place of an empty suffix: there the source has the bare name already.
    most_levels
        How many levels the engine takes; None if it does not mind.
    ending
        The file format that the engine reads best.
    layout
        How levels stand to each other in a file: "siblings", "lod_group" (children of an Empty that is an FBX
        LodGroup), or "msft_lod" (the finest node names the others).
    hull
        The name of a collision hull: `{finest}` is the finest level's name, `{base}` the object's, `{number}` counts
        the hulls from 1; empty if the engine has no such names.
    normal_maps
        Whether coarser levels may have a normal map baked from the finest.
    """

    key: str
    label: str
    suffixes: tuple[str, ...] = ()
    stand_in: str = ""
    most_levels: int | None = None
    ending: str = ".glb"
    layout: str = "siblings"
    hull: str = ""
    normal_maps: bool = True

    def name(self, base: str, level: int) -> str:
        """Name a level, 0 being the finest."""
        return base + (self.suffixes[level] if self.suffixes else f"_LOD{level}")

    def scene_name(self, base: str, level: int) -> str:
        """Name a level that stands in a scene beside its source."""
        name = self.name(base, level)
        return name + self.stand_in if name == base else name

    def hull_name(self, base: str, number: int = 1) -> str:
        """Name a collision hull, the first one being number 1."""
        name = self.hull or "{base}_Hull_{number:02}"
        return name.format(base=base, finest=self.name(base, 0), number=number)

    def why_not(self, levels: int) -> str:
        """Say why the engine does not take so many levels; empty if it does."""
        if self.most_levels is None or levels <= self.most_levels:
            return ""
        return f"{self.label} takes at most {self.most_levels} levels, not {levels}: leave some out"


_ALL = (
    Profile("plain", "Plain", ending=".blend"),
    Profile("unity", "Unity", most_levels=8, ending=".fbx"),
    Profile("unreal", "Unreal Engine", most_levels=8, ending=".fbx", layout="lod_group",
            hull="UCX_{finest}_{number:02}"),
    Profile("godot", "Godot", hull="{base}_Hull_{number:02}-convcolonly"),
    Profile("gltf", "glTF (MSFT_lod)", layout="msft_lod"),
    # Second Life counts from the coarsest, and its finest has no suffix.
    Profile("secondlife", "Second Life", suffixes=("", "_LOD2", "_LOD1", "_LOD0"), stand_in="_LOD3", most_levels=4,
            hull="{base}_PHYS", normal_maps=False),
)
PROFILES = {profile.key: profile for profile in _ALL}
