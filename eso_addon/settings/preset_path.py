# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the presets that come with the add-on are; the user's own are with Blender's."""

from pathlib import Path

import bpy

# Below it stands a folder named as the presets' kind.
_FOLDER = str(Path(__file__).parent.parent / "presets")


def register() -> None:
    """Tell Blender where they are."""
    bpy.utils.register_preset_path(_FOLDER)


def unregister() -> None:
    """Tell Blender that they are gone."""
    bpy.utils.unregister_preset_path(_FOLDER)
