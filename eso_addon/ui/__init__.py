# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn: the sidebar panel `ESO` and the entries in the Object menus."""


def register() -> None:
    """Add the panels and the menu entries."""
    from . import menus, panels

    panels.register()
    menus.register()


def unregister() -> None:
    """Take them away again."""
    from . import menus, panels

    menus.unregister()
    panels.unregister()
