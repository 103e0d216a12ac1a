# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations of everything that is seen."""

import bpy

LANGUAGES: dict[str, dict[str, str]] = {}


def register() -> None:
    """Hand them to Blender."""
    table = {
        language: {("*", text): translated for text, translated in texts.items()}
        for language, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(__package__, table)


def unregister() -> None:
    """Take them back."""
    bpy.app.translations.unregister(__package__)
