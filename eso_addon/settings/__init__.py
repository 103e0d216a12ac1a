# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user chooses: options shared by panel and operators, kept with the scene; engine profiles as data."""


def register() -> None:
    """Add the settings to scenes, the last run's figures to the session, preferences, presets and translations."""
    from . import preferences, preset_path, scene, translations

    for part in (preferences, scene, preset_path, translations):
        part.register()


def unregister() -> None:
    """Take them away again."""
    from . import preferences, preset_path, scene, translations

    for part in (translations, preset_path, scene, preferences):
        part.unregister()
