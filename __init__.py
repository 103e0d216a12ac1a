# SPDX-License-Identifier: GPL-3.0-or-later
"""Root of the extension for Blender: hands over to `eso_addon`, and imports nothing until it is asked to."""


def __getattr__(name: str) -> object:
    """Give Blender's glTF exporter its hook, which it looks for here."""
    if name != "glTF2ExportUserExtension":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .eso_addon import glTF2ExportUserExtension

    return glTF2ExportUserExtension


def register() -> None:
    """Switch the add-on on."""
    from .eso_addon import register as register_addon

    register_addon()


def unregister() -> None:
    """Switch the add-on off."""
    from .eso_addon import unregister as unregister_addon

    unregister_addon()
