# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything of the add-on that is seen in Blender: names, tooltips, and what panels write."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

PACKAGE = Path(__file__).parent.parent.parent / "eso_addon"
# Calls whose words are drawn: the place of the words among the arguments, or the keyword.
_DRAWN_BY_PLACE = {"_draw_button": (3,), "_draw_pair": (1, 2), "draw_text": (1,), "iface": (0,)}
_DRAWN_BY_NAME = {"text", "text_ctxt"}
_TABLES = {"_STREAM", "_OVERLAYS", "_MORE"}


def visible_texts() -> set[str]:
    """Give all texts that a user may see in panels, menus and tooltips; the add-on is registered."""
    texts = {text for cls in registered_classes() for text in texts_of(cls)} | set(drawn_texts()) | set(poll_texts())
    return {text for text in texts if any(letter.isalpha() for letter in text)}


def registered_classes() -> list[type]:
    """Give the classes that the add-on has registered."""
    modules = [module for name, module in sys.modules.items() if name.startswith("eso_addon")]
    found = {value for module in modules for value in vars(module).values() if isinstance(value, type)}
    return [cls for cls in found if getattr(cls, "is_registered", False) and cls.__module__.startswith("eso_addon")]


def texts_of(cls: type) -> Iterator[str]:
    """Give label, tooltip and properties of a class."""
    rna = cls.bl_rna  # type: ignore[attr-defined]
    if issubclass(cls, bpy.types.Operator):  # the class itself does not know its properties
        group, name = cls.bl_idname.split(".")
        rna = getattr(getattr(bpy.ops, group), name).get_rna_type()
    if not issubclass(cls, (bpy.types.PropertyGroup, bpy.types.AddonPreferences)):
        yield getattr(cls, "bl_label", "")
    if issubclass(cls, (bpy.types.Panel, bpy.types.Menu)):
        return
    if issubclass(cls, bpy.types.Operator):
        yield (getattr(cls, "bl_description", "") or cls.__doc__ or "").strip()
    ours = [base for base in cls.__mro__ if base.__module__.startswith("eso_addon")]
    own = {name for base in ours for name in vars(base).get("__annotations__", {})}
    for name in own & set(rna.properties.keys()):
        kind = rna.properties[name]
        if kind.is_hidden:
            continue
        yield kind.name if kind.name != name else ""
        yield kind.description
        if kind.type == "ENUM":
            for item in kind.enum_items_static:
                yield item.name
                yield item.description


def drawn_texts() -> Iterator[str]:
    """Give the words that drawing code holds."""
    for folder in ("ui", "operators", "settings"):
        for path in sorted((PACKAGE / folder).rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            for node in ast.walk(tree):
                if isinstance(node, ast.Call):
                    yield from _words_of_call(node)
                if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in _TABLES:
                    for row in node.value.elts:  # type: ignore[attr-defined]
                        yield from (text for text in _constants(row) if text[:1].isupper() and not text.isupper())


def poll_texts() -> Iterator[str]:
    """Give the reasons why something cannot run, as far as they hold no names."""
    for path in sorted((PACKAGE / "operators").glob("*polls.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Return) and node.value is not None:
                yield from _constants(node.value)


def _words_of_call(node: ast.Call) -> Iterator[str]:
    name = getattr(node.func, "id", getattr(node.func, "attr", ""))
    for place in _DRAWN_BY_PLACE.get(name, ()):
        if place < len(node.args):
            yield from _constants(node.args[place])
    if any(keyword.arg == "translate" for keyword in node.keywords):
        return
    for keyword in node.keywords:
        if keyword.arg in _DRAWN_BY_NAME:
            yield from _constants(keyword.value)


def _constants(node: ast.AST) -> Iterator[str]:
    """Give the texts of a constant, of both ways of a choice, and of a tuple; not those inside a formatted text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from _constants(node.body)
        yield from _constants(node.orelse)
    elif isinstance(node, ast.Tuple):
        for item in node.elts:
            yield from _constants(item)
