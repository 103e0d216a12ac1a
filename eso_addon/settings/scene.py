# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The panel's settings, saved with the scene, and the figures of the last run, kept for the session."""

from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, FloatProperty, PointerProperty, StringProperty

from .level_list import LevelList
from .lod_options import LodOptions
from .options import SimplifyOptions
from .preferences import preferences

# Called with the context when the level slider moves.
on_level: list[Callable[[bpy.types.Context], None]] = []


def _level_moved(_run: bpy.types.bpy_struct, context: bpy.types.Context) -> None:
    for listener in on_level:
        listener(context)


class ESO_PG_settings(SimplifyOptions, LodOptions, LevelList, bpy.types.PropertyGroup):
    """What the panel offers; its names are the operators' own."""

    def hand_over(self, operator: bpy.types.OperatorProperties) -> None:
        """Set an operator's properties to these settings."""
        own = self.bl_rna.properties
        for name, kind in operator.bl_rna.properties.items():
            if name in own and not kind.is_readonly and name != "name":
                setattr(operator, name, getattr(self, name))


class ESO_PG_last_run(bpy.types.PropertyGroup):
    """How far the run is that goes on, and what the last one reported, one line each."""

    title: StringProperty()
    lines: StringProperty()
    running: StringProperty()
    progress: FloatProperty()
    stopping: BoolProperty()
    seconds: FloatProperty()
    level: FloatProperty(
        name="Level", description="Drag through all levels, from the coarsest to the mesh itself", default=1.0, min=0.0,
        max=1.0, precision=3, subtype="FACTOR", update=_level_moved,
    )  # fmt: skip

    def show(self, title: str, *lines: str) -> None:
        """Keep a report for the panel."""
        self.title = title
        self.lines = "\n".join(lines)


@persistent
def start_with_profile(*_: object) -> None:
    """Let scenes that have not chosen an engine start with the one of the preferences."""
    for scene in bpy.data.scenes:
        if scene.library is None and not scene.eso_lod.is_property_set("profile"):
            scene.eso_lod.profile = preferences().profile


_CLASSES = (ESO_PG_settings, ESO_PG_last_run)


def register() -> None:
    """Register the classes and hang them on scenes and on the window manager."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.eso_lod = PointerProperty(type=ESO_PG_settings)
    bpy.types.WindowManager.eso_last_run = PointerProperty(type=ESO_PG_last_run)
    bpy.app.handlers.load_post.append(start_with_profile)


def unregister() -> None:
    """Take them away again."""
    if start_with_profile in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(start_with_profile)
    del bpy.types.WindowManager.eso_last_run
    del bpy.types.Scene.eso_lod
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
