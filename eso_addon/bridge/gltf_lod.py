# SPDX-License-Identifier: GPL-3.0-or-later
"""MSFT_lod: the hook by which Blender's glTF exporter writes levels, so that other readers see the finest alone."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy

from ..core.screen import Screen
from . import level_info

NAME = "MSFT_lod"


@dataclass(frozen=True)
class NodeLevels:
    """Levels that stand for each other.

    Attributes
    ----------
    levels : sequence of bpy.types.Object
        The finest first.
    coverages : sequence of float
        The least part of the screen that each level is for.
    """

    levels: Sequence[bpy.types.Object]
    coverages: Sequence[float]


def coverages_of(levels: Sequence[bpy.types.Object]) -> list[float]:
    """Give the part of the screen at which each level gives way to the next; the last stays down to nothing."""
    settings = level_info.settings_of(levels[0]) or {}
    screen = Screen(**settings.get("screen", {}))
    corners = levels[0].bound_box
    sides = [max(axis) - min(axis) for axis in zip(*corners, strict=True)]
    scale = levels[0].matrix_world.to_scale()
    radius = sum((side * factor) ** 2 for side, factor in zip(sides, scale, strict=True)) ** 0.5 / 2
    distances = [float(level.get(level_info.DISTANCE, 0.0)) for level in levels[1:]]
    return [*(screen.coverage(radius, distance) for distance in distances), 0.0]


def chosen_levels(objects: Sequence[bpy.types.Object]) -> list[NodeLevels]:
    """Group those levels among objects that were made for glTF."""
    by_source: dict[str, list[bpy.types.Object]] = {}
    for obj in objects:
        if level_info.is_level(obj) and obj.get(level_info.PROFILE) == "gltf":
            by_source.setdefault(str(obj[level_info.SOURCE]), []).append(obj)
    groups = [sorted(group, key=lambda obj: obj[level_info.LEVEL]) for group in by_source.values()]
    return [NodeLevels(group, coverages_of(group)) for group in groups if len(group) > 1]


class glTF2ExportUserExtension:
    """What the exporter calls; it finds it on the add-on's root module."""

    def __init__(self) -> None:
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        self._extension = Extension
        self._nodes: dict[bpy.types.Object, Any] = {}

    def gather_node_hook(self, node: Any, obj: bpy.types.Object | None, _settings: Any) -> None:  # noqa: ANN401
        """Remember the node of an object."""
        if isinstance(obj, bpy.types.Object):
            self._nodes.setdefault(obj, node)

    def gather_scene_hook(self, scene: Any, _blender_scene: bpy.types.Scene, _settings: Any) -> None:  # noqa: ANN401
        """Take coarser levels out of the scene, and have the finest name them."""
        for group in chosen_levels(list(self._nodes)):
            finest, *coarser = (self._nodes[level] for level in group.levels)
            _take_out(scene.nodes, coarser)
            extension = self._extension(name=NAME, extension={"ids": coarser}, required=False)
            finest.extensions = {**(finest.extensions or {}), NAME: extension}
            finest.extras = {**(finest.extras or {}), "MSFT_screencoverage": list(group.coverages)}


def _take_out(nodes: list[Any], gone: list[Any]) -> None:
    """Take nodes out of a tree."""
    nodes[:] = [node for node in nodes if not any(node is other for other in gone)]
    for node in nodes:
        if isinstance(node.children, list):
            _take_out(node.children, gone)
            node.children = node.children or None


@contextmanager
def hooked() -> Iterator[None]:
    """Have the exporter find the hook, also where this package runs without being an add-on of Blender's."""
    package = __package__.rpartition(".")[0]
    addons = bpy.context.preferences.addons
    if package in addons.keys() or package.rpartition(".")[0] in addons.keys():  # noqa: SIM118 - no plain dictionary
        yield
        return
    assert package in sys.modules
    entry = addons.new()
    entry.module = package
    try:
        yield
    finally:
        addons.remove(entry)
