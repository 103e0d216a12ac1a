# SPDX-License-Identifier: GPL-3.0-or-later
"""The fixtures of everything that touches Blender."""

from tests.bridge.blender_scenes import addon, empty_file

__all__ = ["addon", "empty_file"]
