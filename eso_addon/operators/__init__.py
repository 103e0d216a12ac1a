# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: each operator polls, hands arrays to the engine, writes the result and reports."""


def register() -> None:
    """Register the operators; threads end before another file is loaded."""
    import bpy

    from . import lifetime, lod_generate, lod_update, measure, simplify, staleness

    for module in (simplify, lod_generate, lod_update, measure):
        bpy.utils.register_class(module.OPERATOR)
    lifetime.register()
    staleness.register()


def unregister() -> None:
    """End every thread and unregister the operators."""
    import bpy

    from . import lifetime, lod_generate, lod_update, measure, simplify, staleness

    staleness.unregister()
    lifetime.unregister()
    for module in (measure, lod_update, lod_generate, simplify):
        bpy.utils.unregister_class(module.OPERATOR)
