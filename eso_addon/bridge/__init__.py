# SPDX-License-Identifier: GPL-3.0-or-later
"""The only way between Blender's data and arrays: attributes, meshes in and out, objects and LOD collections."""
