# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: each operator polls, hands arrays to the engine, writes the result and reports."""

from importlib import import_module

# Those with one operator in `OPERATOR`, or several in `OPERATORS`.
_MODULES = (
    "simplify",
    "lod_generate",
    "lod_update",
    "lod_export",
    "lod_hulls",
    "lod_bake",
    "measure",
    "weights_show",
    "edges_show",
    "deviation_show",
    "overlay_hide",
    "level_slide",
    "level_list",
    "export_esopm",
    "import_esopm",
)
# What else is switched on and off.
_LISTENERS = ("lifetime", "staleness", "level_slide", "shown", "stream_level")


def register() -> None:
    """Register the operators; threads end before another file is loaded."""
    import bpy

    for cls in _classes():
        bpy.utils.register_class(cls)
    for name in _LISTENERS:
        import_module(f".{name}", __name__).register()


def unregister() -> None:
    """End every thread and unregister the operators."""
    import bpy

    for name in reversed(_LISTENERS):
        import_module(f".{name}", __name__).unregister()
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)


def _classes() -> list[type]:
    modules = [import_module(f".{name}", __name__) for name in _MODULES]
    return [cls for module in modules for cls in getattr(module, "OPERATORS", None) or (module.OPERATOR,)]
