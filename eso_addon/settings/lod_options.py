# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The options of a chain of levels as Blender properties, once, for the panel and for the operators."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..core.errors import MeshError
from .keep_options import KeepOptions
from .level_text import TEXT_OF, read_levels
from .options import EngineOptions
from .profiles import PROFILES
from .screen_options import ScreenOptions

if TYPE_CHECKING:
    from .lod_record import LodSettings

_SCOPES = (
    ("SELECTED", "Selected", "Levels of every selected mesh, and of the meshes that selected empties instance"),
    ("COLLECTION", "Collection", "Levels of every mesh in a collection"),
)
_LEVELS_BY = (
    ("ratio", "Ratio", "Share of each mesh's triangles"),
    ("count", "Count", "Triangles of each mesh"),
    ("error", "Error", "Largest deviation"),
    ("screen", "Screen", "Sizes on screen, in pixels, at which nobody sees a difference"),
    ("budget", "Budget", "Triangles of all meshes together, spent where they matter most"),
)
_PROFILES = tuple((name, profile.label, f"Names and layout for {profile.label}") for name, profile in PROFILES.items())


class LodOptions(EngineOptions, KeepOptions, ScreenOptions):
    """A chain of levels."""

    levels_by: EnumProperty(name="Levels By", items=_LEVELS_BY, default="ratio")
    ratios: StringProperty(
        name="Ratios",
        description="Share of the triangles at each level, such as 0.5, 0.25, 0.1",
        default="0.5, 0.25, 0.1",
    )
    faces_targets: StringProperty(
        name="Triangles", description="Triangles of each level, such as 8000, 2000, 500", default="8000, 2000, 500"
    )
    max_errors: StringProperty(
        name="Errors",
        description="Largest deviation of each level in the scene's units, such as 0.001, 0.01",
        default="0.001, 0.01",
    )
    screen_sizes: StringProperty(
        name="Sizes",
        description="Pixels of the longest side on screen where each level begins, such as 800, 400, 100",
        default="800, 400, 100",
    )
    budgets: StringProperty(
        name="Triangles in All",
        description="Triangles of all meshes together at each level, such as 100000, 25000",
        default="100000, 25000",
    )
    profile: EnumProperty(name="Profile", items=_PROFILES, default="plain")
    scope: EnumProperty(name="Of", items=_SCOPES, default="SELECTED")
    source_collection: StringProperty(
        name="Meshes In", description="The collection whose meshes get levels; empty: the active one", default=""
    )
    collection: StringProperty(
        name="Collection", description="Where the levels go; empty: a collection named after the object", default=""
    )
    replace: BoolProperty(
        name="Replace Earlier",
        description="Make the levels that this object has anew, in place; otherwise they stay beside the new ones",
        default=True,
    )
    live_mirror: BoolProperty(
        name="Live Mirror", description="Simplify one half; the levels keep the Mirror modifier", default=False
    )
    live_subdivision: BoolProperty(
        name="Live Subdivision",
        description="Simplify the cage; the levels keep the Subdivision Surface modifier",
        default=False,
    )

    def draw_levels(self, layout: bpy.types.UILayout, *, as_text: bool = True) -> None:
        """Draw the levels' kind, their list unless it is drawn as rows, and where they go."""
        layout.prop(self, "levels_by")
        if as_text:
            layout.prop(self, TEXT_OF[self.levels_by])
        if self.levels_by == "screen":
            self.draw_screen(layout)
        layout.prop(self, "profile")
        if as_text:
            self.draw_places(layout)

    def draw_places(self, layout: bpy.types.UILayout) -> None:
        """Draw which meshes get levels, where these go, and what stays live on them."""
        layout.prop(self, "scope")
        if self.scope == "COLLECTION":
            layout.prop_search(self, "source_collection", bpy.data, "collections")
        layout.prop_search(self, "collection", bpy.data, "collections")
        layout.prop(self, "replace")
        column = layout.column()
        column.active = self.apply_modifiers
        column.prop(self, "live_mirror")
        column.prop(self, "live_subdivision")

    def level_goals(self) -> tuple[str, list[float]]:
        """Give the kind of the levels and a number for each, the finest first.

        Raises
        ------
        MeshError
            The list cannot be read, names a level twice, or has more levels than the profile takes.
        """
        from .lod_record import ordered_goals

        kind = self.levels_by
        goals = ordered_goals(kind, read_levels(kind, getattr(self, TEXT_OF[kind])))
        reason = PROFILES[self.profile].why_not(len(goals))
        if reason:
            raise MeshError(reason)
        return kind, goals

    def lod_settings(self) -> "LodSettings":
        """Give all of it as plain data."""
        from .lod_record import LodSettings

        kind, goals = self.level_goals()
        live = {"ARMATURE": True, "MIRROR": self.live_mirror, "SUBSURF": self.live_subdivision}
        return LodSettings(
            kind=kind,
            values=goals,
            screen=self.screen_settings(),
            engine=self.engine_options(),
            apply_modifiers=self.apply_modifiers,
            live=[name for name, is_live in live.items() if is_live],
            profile=self.profile,
            group=self.group_settings(),
            writing=self.writing(),
        )
