# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user chooses: options shared by panel and operators, kept with the scene; engine profiles as data."""


def register() -> None:
    """Add the settings to scenes and the last run's figures to the session."""
    from . import scene

    scene.register()


def unregister() -> None:
    """Take them away again."""
    from . import scene

    scene.unregister()
