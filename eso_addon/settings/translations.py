# SPDX-License-Identifier: GPL-3.0-or-later
"""Hands the translations to Blender."""

import bpy

from .texts import LANGUAGES, TEXTS

# Operators' labels and the words on buttons are looked up in contexts of their own.
_CONTEXTS = ("*", "Operator")


def register() -> None:
    """Tell Blender how everything is called in other languages."""
    table = {
        language: {(context, text): texts[number] for text, texts in TEXTS.items() for context in _CONTEXTS}
        for number, language in enumerate(LANGUAGES)
    }
    bpy.app.translations.register(__package__, table)


def unregister() -> None:
    """Take it back."""
    bpy.app.translations.unregister(__package__)
