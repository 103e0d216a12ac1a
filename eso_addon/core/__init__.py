# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as numpy arrays: weights, quadrics, the collapse engine, refit and measures. numpy and nothing else."""
