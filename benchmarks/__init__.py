# SPDX-License-Identifier: GPL-3.0-or-later
"""What is timed: the engine and its peers, side by side on the same meshes. Not shipped in the add-on."""
