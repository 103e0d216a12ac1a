# SPDX-License-Identifier: GPL-3.0-or-later
"""Dense scans: a tenth is left, and much less in the levels."""

import bpy

settings = bpy.context.scene.eso_lod
settings.target = "ratio"
settings.ratio = 0.1
settings.preset = "default"
settings.method = "eso"
settings.rings = 3
settings.placement = "optimal"
settings.refit = True
settings.weld = True
settings.prune = 0.0
settings.levels_by = "ratio"
settings.ratios = "0.3, 0.1, 0.03, 0.01"
