# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn: the sidebar panels `ESO`, the entries in the Object menus, presets, and overlays."""


def register() -> None:
    """Add the panels, the menu entries and the overlays."""
    from . import menus, overlay, panels, presets, stream

    for part in (presets, panels, menus, overlay, stream):
        part.register()


def unregister() -> None:
    """Take them away again."""
    from . import menus, overlay, panels, presets, stream

    for part in (stream, overlay, menus, panels, presets):
        part.unregister()
