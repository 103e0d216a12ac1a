# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that is seen is there in every language."""

import bpy
import pytest

from eso_addon.settings.texts import LANGUAGES, TEXTS
from tests.bridge.blender_scenes import addon
from tests.settings.visible import registered_classes, texts_of, visible_texts

__all__ = ["addon"]

# Called so everywhere.
NAMES = {"ESO", "ESO LOD", "SO", "QEM", "Unity", "Unreal Engine", "Godot", "glTF (MSFT_lod)", "Second Life"}

pytestmark = pytest.mark.usefixtures("addon")


def test_nothing_that_is_seen_lacks_a_translation() -> None:
    missing = visible_texts() - set(TEXTS) - NAMES
    assert not missing, f"add these to eso_addon/settings/texts.py: {sorted(missing)}"


def test_each_text_is_there_in_each_language() -> None:
    for text, translated in TEXTS.items():
        assert len(translated) == len(LANGUAGES), text
        assert all(word.strip() == word and word for word in translated), text
        if len(text) > 20:  # no tooltip ends with a stop; short names may be cut with one
            assert not any(word.endswith((".", "。")) for word in translated), text


def test_blender_takes_them() -> None:
    for language in LANGUAGES:
        assert language.split("_")[0] in {"de", "es", "ja", "zh"}
    bpy.app.translations.unregister("eso_addon.settings")
    from eso_addon.settings import translations

    translations.register()


def test_tooltips_are_there_and_end_without_a_stop() -> None:
    for cls in registered_classes():
        for text in texts_of(cls):
            assert not text.endswith("."), text
        if issubclass(cls, bpy.types.Operator):
            assert (getattr(cls, "bl_description", "") or cls.__doc__ or "").strip(), cls
            own = [base for base in cls.__mro__ if base.__module__.startswith("eso_addon")]
            group, name = cls.bl_idname.split(".")
            properties = getattr(getattr(bpy.ops, group), name).get_rna_type().properties
            for key in {key for base in own for key in vars(base).get("__annotations__", {})} & set(properties.keys()):
                kind = properties[key]
                assert kind.is_hidden or kind.description or kind.type == "ENUM" or key == "filepath", (cls, key)
