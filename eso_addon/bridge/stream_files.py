# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams from and to files that Blender reads and writes, for the command line."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..files.off import FileFormatError
from ..progressive.progressive import Level
from ..progressive.scene import Scene
from .quiet import quiet
from .scene_files import READERS, missing_libraries, start_empty, visible_meshes, write_scene
from .stream_mesh import StreamMesh
from .stream_objects import add_objects, read_objects


def read_stream_objects(path: Path, *, keep_order: bool) -> tuple[list[StreamMesh], dict[str, Any]]:
    """Read all visible meshes of a file with all that they hold.

    Raises
    ------
    FileFormatError
        Blender cannot read the file, or finds no mesh in it.
    OSError
        The file cannot be opened.
    """
    with path.open("rb"):
        pass  # says why a file cannot be opened better than Blender does
    with quiet(f"cannot read {path.name}"):
        READERS[path.suffix.lower()](path)
        objects = visible_meshes()
        if objects:
            meshes, meta = read_objects(objects, keep_order=keep_order)
            meshes[0].left_behind += missing_libraries()
            return meshes, meta
    raise FileFormatError(f"{path.name} has no visible mesh: nothing to work on")


def write_levels(path: Path, scene: Scene, levels: Sequence[Level]) -> None:
    """Write the objects of a stream at some levels to a file, in a scene of their own."""
    with quiet(f"cannot write {path.name}"):
        start_empty()
        write_scene(path, add_objects(scene, levels, bpy.context.scene.collection))
