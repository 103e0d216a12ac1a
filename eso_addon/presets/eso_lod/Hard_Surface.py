# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines and buildings: one ring, so that crisp edges stand out."""

import bpy

settings = bpy.context.scene.eso_lod
settings.target = "ratio"
settings.ratio = 0.5
settings.preset = "default"
settings.method = "so"
settings.rings = 1
settings.placement = "optimal"
settings.refit = True
settings.weld = True
settings.prune = 0.0
settings.levels_by = "ratio"
settings.ratios = "1, 0.5, 0.2, 0.08"
