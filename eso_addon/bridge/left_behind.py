# SPDX-License-Identifier: GPL-3.0-or-later
"""Names the data of a mesh that its simplified versions do not carry."""

import bpy

from .layers import unreadable


def names_left_behind(mesh: bpy.types.Mesh, lost: str = "") -> tuple[str, ...]:
    """List what is lost.

    Parameters
    ----------
    mesh : bpy.types.Mesh
        The mesh that was read, evaluated or not.
    lost : str
        What could not be read.

    Returns
    -------
    names : tuple of str
        Such as ``"attributes (Cells)"`` of a type that this version does not know; empty if nothing is lost.
    """
    unknown = ", ".join(unreadable(mesh))
    return tuple(name for name in (f"attributes ({unknown})" if unknown else "", lost) if name)
