# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m demo`: the main job on the paper's cow. Not shipped in the add-on."""
