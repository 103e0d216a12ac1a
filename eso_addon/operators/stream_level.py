# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The level of an imported stream, for afterwards: a property of its objects."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.errors import MeshError
from ..progressive.errors import StreamError

if TYPE_CHECKING:
    from ..progressive.progressive import Level
    from ..progressive.scene import Scene

_quiet = False  # the property is being set to what is shown already


def _show(self: "EsoStream", context: bpy.types.Context) -> None:
    """Give the object, and all that show its mesh, the level of the slider."""
    if _quiet or not self.path:
        return
    from ..bridge.stream_objects import loaded_scene, replace_level

    obj = self.id_data
    if obj.mode == "EDIT":
        self.trouble = "Leave Edit Mode to change the level"
        return
    try:
        scene = loaded_scene(Path(bpy.path.abspath(self.path)), partial=True)
        mesh = scene.meshes[self.mesh]
        count = round(mesh.face_count * self.percent / 100)
        level = mesh.restore() if count >= mesh.face_count else mesh.at(faces=count)
    except (MeshError, StreamError, OSError, IndexError) as error:
        self.trouble = f"The stream cannot be read: {error}"
        return
    users = [other for other in bpy.data.objects if other.data == obj.data]
    replace_level(obj, scene, self.mesh, level)
    _note(users, mesh.face_count, self.percent, "")


def _note(objects: Sequence[bpy.types.Object], faces: int, percent: float, trouble: str) -> None:
    global _quiet
    _quiet = True
    try:
        for obj in objects:
            obj.eso_stream.faces, obj.eso_stream.trouble = faces, trouble
            if obj.eso_stream.percent != percent:
                obj.eso_stream.percent = percent
    finally:
        _quiet = False


class EsoStream(bpy.types.PropertyGroup):
    """Where an object's mesh comes from."""

    path: StringProperty(name="Stream", subtype="FILE_PATH")
    mesh: IntProperty(name="Mesh", description="Its number in the file", min=0)
    faces: IntProperty(name="Triangles", description="Of the original", min=0)
    trouble: StringProperty()
    percent: FloatProperty(
        name="Level", description="Triangles shown, as a part of the original's", subtype="PERCENTAGE", min=0.0,
        max=100.0, default=100.0, update=_show)


def remember(objects: Sequence[bpy.types.Object], path: Path, scene: "Scene", levels: "Sequence[Level]") -> None:
    """Tell new objects where their meshes come from; in the order of `add_objects`."""
    entries = scene.meta.get("objects") or [{"mesh": number} for number in range(len(scene.meshes))]
    for obj, entry in zip(objects, entries, strict=True):
        number = entry["mesh"]
        whole = scene.meshes[number].face_count
        obj.eso_stream.path, obj.eso_stream.mesh = str(path), number
        _note([obj], whole, 100.0 * len(levels[number].faces) / max(whole, 1), "")


def register() -> None:
    """Give objects the property."""
    bpy.utils.register_class(EsoStream)
    bpy.types.Object.eso_stream = PointerProperty(type=EsoStream)


def unregister() -> None:
    """Take it away again."""
    del bpy.types.Object.eso_stream
    bpy.utils.unregister_class(EsoStream)
