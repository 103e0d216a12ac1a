# SPDX-License-Identifier: GPL-3.0-or-later
"""Files read and written without Blender."""
