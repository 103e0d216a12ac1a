# SPDX-License-Identifier: GPL-3.0-or-later
"""Progressive meshes: patches in batches, their coder, the .esopm container, and any level of detail from it."""
