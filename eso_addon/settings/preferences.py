# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The add-on's preferences: the profile that new scenes start with, threads, and pymeshlab."""

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from .profiles import PROFILES

# The add-on's key: the root package of the extension, or this package where there is no root.
KEY = __package__.rpartition(".")[0].removesuffix(".eso_addon")
_PROFILES = tuple((name, profile.label, f"Names and layout for {profile.label}") for name, profile in PROFILES.items())


class ESO_AP_preferences(bpy.types.AddonPreferences):
    """What holds for all files."""

    bl_idname = KEY

    profile: EnumProperty(
        name="Default Profile", description="The engine whose levels new scenes start with", items=_PROFILES,
        default="plain",
    )  # fmt: skip
    threads: IntProperty(
        name="Threads",
        description="Processors that the engine may use; 0 takes two for large meshes, else one. "
                    "Results do not depend on it",
        default=0,
        min=0,
        max=64,
    )
    use_pymeshlab: BoolProperty(
        name="Check with pymeshlab",
        description="Measure a second time with pymeshlab where it is installed, in a process of its own",
        default=False,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw them below the add-on in the Preferences."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "profile")
        layout.prop(self, "threads")
        layout.prop(self, "use_pymeshlab")


class _Defaults:
    """What holds where Blender keeps no preferences for the add-on: a plain package in a script."""

    profile = "plain"
    threads = 0
    use_pymeshlab = False


def preferences() -> Any:  # noqa: ANN401 - preferences, or what stands in for them
    """Give the add-on's preferences, or the defaults."""
    addon = bpy.context.preferences.addons.get(KEY)
    kept = addon.preferences if addon else None
    return kept if isinstance(kept, ESO_AP_preferences) else _Defaults


def register() -> None:
    """Register the preferences."""
    bpy.utils.register_class(ESO_AP_preferences)


def unregister() -> None:
    """Unregister them."""
    bpy.utils.unregister_class(ESO_AP_preferences)
