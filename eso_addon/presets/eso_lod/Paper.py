# SPDX-License-Identifier: GPL-3.0-or-later
"""The equations as printed, for comparison."""

import bpy

settings = bpy.context.scene.eso_lod
settings.target = "ratio"
settings.ratio = 0.5
settings.preset = "paper"
settings.method = "eso"
settings.rings = 3
settings.placement = "optimal"
settings.refit = False
settings.weld = True
settings.prune = 0.0
settings.levels_by = "ratio"
settings.ratios = "1, 0.5, 0.25, 0.1"
