# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials and worlds."""

import bpy


def use_nodes(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """
    Have a material or a world drawn by its nodes, and give them.

    Blender 5.0 and later always do, and warn whoever asks them to: where warnings are errors, the
    first such warning costs the process Blender's type of node trees.
    """
    if bpy.app.version < (5, 0):
        owner.use_nodes = True
    return owner.node_tree
