# SPDX-License-Identifier: GPL-3.0-or-later
"""Root of the extension for Blender: hands over to `eso_addon`, and imports nothing until it is asked to."""


def register() -> None:
    """Switch the add-on on."""
    from .eso_addon import register as register_addon

    register_addon()


def unregister() -> None:
    """Switch the add-on off."""
    from .eso_addon import unregister as unregister_addon

    unregister_addon()
