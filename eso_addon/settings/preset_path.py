# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the presets that come with the add-on are; the user's own are with Blender's."""

from pathlib import Path

import bpy

# Below it stands a folder named as the presets' kind.
_FOLDER = str(Path(__file__).parent.parent / "presets")
# Blender 4.2 asks no add-on for presets: there the menus look into the folder themselves.
IS_KNOWN = hasattr(bpy.utils, "register_preset_path")


def unknown_folders(subdirectory: str) -> list[str]:
    """Give the folders of presets that Blender does not find by itself."""
    return [] if IS_KNOWN else [str(Path(_FOLDER) / subdirectory)]


def register() -> None:
    """Tell Blender where they are."""
    if IS_KNOWN:
        bpy.utils.register_preset_path(_FOLDER)


def unregister() -> None:
    """Tell Blender that they are gone."""
    if IS_KNOWN:
        bpy.utils.unregister_preset_path(_FOLDER)
