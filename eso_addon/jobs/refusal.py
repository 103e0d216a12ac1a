# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator says when it cannot do its work."""

import bpy


def refuse(operator: bpy.types.Operator, error: Exception) -> set[str]:
    """Report an error in one line, and give what Blender wants of an operator that has done nothing."""
    text = "not enough memory for this mesh: simplify it in parts" if isinstance(error, MemoryError) else str(error)
    text = " ".join(text.split())
    operator.report({"ERROR"}, text[:1].upper() + text[1:])
    return {"CANCELLED"}
