# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages that must load quickly: a quarter is left, and small levels."""

import bpy

settings = bpy.context.scene.eso_lod
settings.target = "ratio"
settings.ratio = 0.25
settings.preset = "default"
settings.method = "eso"
settings.rings = 3
settings.placement = "optimal"
settings.refit = True
settings.weld = True
settings.prune = 0.0
settings.levels_by = "ratio"
settings.ratios = "0.25, 0.08, 0.02"
