# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels in a file, named and laid out as an engine wants them."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ..core.mesh import MeshError
from ..files.atomic import atomic_output
from . import level_info
from .gltf_lod import hooked
from .staging import staged

ENDINGS = (".blend", ".fbx", ".glb", ".gltf", ".obj")


@dataclass(frozen=True)
class LevelGroup:
    """The levels and hulls of one object, under the names that they have in the file.

    Attributes
    ----------
    base : str
        The object's name.
    levels, hulls : mapping
        Objects and their names, the finest first.
    """

    base: str
    levels: Mapping[bpy.types.Object, str]
    hulls: Mapping[bpy.types.Object, str] = field(default_factory=dict)


def groups_of(families: Sequence[level_info.Family], name: Callable[[str, int], str],
              hull_name: Callable[[str, int], str]) -> list[LevelGroup]:
    """Give what was made from each object the names that a profile gives."""
    return [LevelGroup(
        family.name, {level: name(family.name, number) for number, level in enumerate(family.levels)},
        {hull: hull_name(family.name, number) for number, hull in enumerate(family.hulls, start=1)},
    ) for family in families]


def export_levels(path: Path, groups: Sequence[LevelGroup], layout: str, write: Callable[[Path], None]) -> None:
    """Write levels to a file, which appears whole or not at all; the scene is as before afterwards.

    Parameters
    ----------
    path : Path
    groups : sequence of LevelGroup
    layout : str
        "siblings", "lod_group" or "msft_lod"; see `Profile`.
    write : callable
        Writes the selected objects of the scene in the window.

    Raises
    ------
    MeshError
        Nothing to write.
    OSError, RuntimeError
        The file cannot be written.
    """
    if not groups:
        raise MeshError("there are no levels to write: generate some first")
    names = {obj: name for group in groups for obj, name in [*group.levels.items(), *group.hulls.items()]}
    parents = {obj: _upper(obj) for obj in names if obj.parent is not None and obj.parent.type == "MESH"}
    grouped = groups if layout == "lod_group" and path.suffix.lower() == ".fbx" else []
    with _lod_groups(grouped) as children, _marked(groups, layout):
        names |= {empty: base for empty, (base, _) in children.items()}
        parents |= {level: empty for empty, (_, levels) in children.items() for level in levels}
        with staged(path.stem, names, parents), hooked(), atomic_output(path) as draft, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what Blender's exporters ask of numpy
            write(draft)


def _upper(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Find the next parent that is no mesh: those are not in the file, or have levels of their own."""
    parent = obj.parent
    while parent is not None and parent.type == "MESH":
        parent = parent.parent
    return parent


@contextmanager
def _lod_groups(groups: Sequence[LevelGroup]
                ) -> Iterator[dict[bpy.types.Object, tuple[str, list[bpy.types.Object]]]]:
    """Make an Empty for each object, which the FBX exporter writes as a LodGroup, with the levels as its children."""
    made: dict[bpy.types.Object, tuple[str, list[bpy.types.Object]]] = {}
    try:
        for group in groups:
            empty = bpy.data.objects.new("eso_lod group", None)
            empty["fbx_type"] = "LodGroup"
            levels = list(group.levels)
            made[empty] = (group.base, levels)
            parent = _upper(levels[0])
            empty.parent = parent
            empty.matrix_world = levels[0].matrix_world if parent is None else parent.matrix_world
        bpy.context.view_layer.update()
        yield made
    finally:
        for empty in made:
            bpy.data.objects.remove(empty)


@contextmanager
def _marked(groups: Sequence[LevelGroup], layout: str) -> Iterator[None]:
    """Have the glTF hook see the levels as made for it, or not for it."""
    profile = "gltf" if layout == "msft_lod" else ""
    before = {level: level.get(level_info.PROFILE) for group in groups for level in group.levels}
    try:
        for level in before:
            level[level_info.PROFILE] = profile
        yield
    finally:
        for level, value in before.items():
            if value is None:
                del level[level_info.PROFILE]
            else:
                level[level_info.PROFILE] = value
