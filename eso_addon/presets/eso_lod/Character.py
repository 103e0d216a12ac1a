# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies that bend: two rings, so that joints keep their loops, and finer levels."""

import bpy

settings = bpy.context.scene.eso_lod
settings.target = "ratio"
settings.ratio = 0.6
settings.preset = "default"
settings.method = "eso"
settings.rings = 2
settings.placement = "optimal"
settings.refit = True
settings.weld = True
settings.prune = 0.0
settings.levels_by = "ratio"
settings.ratios = "1, 0.6, 0.3, 0.12"
