# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels that suit an engine, as data: its profile, and shares of the triangles."""

LEVEL_SETS: dict[str, tuple[str, str]] = {
    "Plain": ("plain", "0.5, 0.25, 0.1"),
    "Unity": ("unity", "1, 0.5, 0.25, 0.1"),
    "Unreal Engine": ("unreal", "1, 0.5, 0.25, 0.12"),
    "Godot": ("godot", "1, 0.5, 0.25, 0.1"),
    "glTF": ("gltf", "1, 0.4, 0.15, 0.05"),
    "Second Life": ("secondlife", "1, 0.5, 0.25, 0.1"),
}
