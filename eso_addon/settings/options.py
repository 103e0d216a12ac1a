# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads properties from annotations that are calls:
# mypy: disable-error-code="valid-type"
"""The options of the engine as Blender properties, once, for the panel and for the operators; words as in the API."""

from inspect import get_annotations
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from .keep_options import KeepOptions
from .preferences import preferences
from .screen_options import ScreenOptions

if TYPE_CHECKING:
    from ..core.screen import Screen

_TARGETS = (
    ("ratio", "Ratio", "Keep this share of the triangles"),
    ("count", "Count", "Keep this many triangles"),
    ("error", "Error", "Keep as few triangles as this deviation allows"),
    ("screen", "Screen", "Keep as few triangles as look the same at a size on screen"),
)
_LINES = (
    ("kept", "Kept", "Simplified along themselves, crossed last"),
    ("locked", "Locked", "Not touched"),
    ("ignored", "Ignored", "Simplified like everything else"),
)
_SYMMETRIES = (
    ("none", "None", "Both sides are simplified as they come"),
    ("x", "X", "A mesh that is symmetric over X stays so"),
    ("y", "Y", "A mesh that is symmetric over Y stays so"),
    ("z", "Z", "A mesh that is symmetric over Z stays so"),
)
_METHODS = (
    ("eso", "ESO", "Extended shape operator: features by the surface variation within several rings"),
    ("so", "SO", "Shape operator: surface variation within one ring"),
    ("cf", "Curvature Factor", "Edges weighted by the curvature at both ends"),
    ("qem", "QEM", "Plain quadric error metric of Garland and Heckbert"),
)
_PLACEMENTS = (
    ("optimal", "Optimal", "New vertices stand where the error is least"),
    ("endpoint", "Endpoint", "Every vertex left is one of the source's"),
)
_PRESETS = (
    ("default", "Default", "The best that was measured"),
    ("paper", "Paper", "Equations 8 and 9 as printed, for comparison"),
)
_LINE_NAMES = ("seam_lines", "material_lines", "sharp_lines", "boundary_lines")


class EngineOptions:
    """How the engine works, whatever the target."""

    preset: EnumProperty(name="Preset", items=_PRESETS, default="default")
    method: EnumProperty(name="Method", items=_METHODS, default="eso")
    rings: IntProperty(
        name="Rings",
        description="Rings of neighbours that an ESO weight looks at",
        default=3,
        min=1,
        max=16,
        soft_max=8,
    )
    placement: EnumProperty(name="Placement", items=_PLACEMENTS, default="optimal")
    refit: BoolProperty(
        name="Refit", description="Move the vertices left so that the new surface fits the old one", default=True
    )
    weld: BoolProperty(
        name="Weld",
        description="Treat vertices at equal positions as one, so that split seams stay closed",
        default=True,
    )
    prune: FloatProperty(
        name="Prune Below",
        description="Drop loose parts smaller than this; 0 keeps every part",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    seam_lines: EnumProperty(
        name="Seams", description="Seams of UV maps and other values that jump", items=_LINES, default="kept"
    )
    material_lines: EnumProperty(
        name="Material Borders", description="Edges between materials", items=_LINES, default="kept"
    )
    sharp_lines: EnumProperty(
        name="Sharp Edges", description="Marked edges, creases, and where normals are split", items=_LINES,
        default="kept"
    )
    boundary_lines: EnumProperty(
        name="Boundaries", description="Edges of one face only", items=_LINES, default="kept"
    )
    symmetry: EnumProperty(
        name="Symmetry", description="Give a symmetric result of a symmetric mesh", items=_SYMMETRIES, default="none"
    )
    apply_modifiers: BoolProperty(
        name="Apply Modifiers",
        description="Simplify the mesh as modifiers and shape keys show it; otherwise the results keep the modifiers",
        default=True,
    )

    hide_others: BoolProperty(
        name="Hide Others",
        description="Hide the source and coarser levels in the viewport: all of them stand in the same place",
        default=True,
    )

    def draw_engine(self, layout: bpy.types.UILayout) -> None:
        """Draw the options; what has no effect is greyed."""
        layout.prop(self, "preset")
        layout.prop(self, "method")
        row = layout.row()
        row.active = self.method == "eso"
        row.prop(self, "rings")
        layout.prop(self, "placement")
        layout.prop(self, "prune")
        row = layout.row()
        row.active = self.preset == "default" and self.placement == "optimal"
        row.prop(self, "refit")
        layout.prop(self, "weld")
        for name in _LINE_NAMES:
            layout.prop(self, name)
        layout.prop(self, "symmetry")
        layout.prop(self, "apply_modifiers")
        layout.prop(self, "hide_others")

    def engine_options(self) -> dict[str, Any]:
        """Give the options as `simplify` and `lod_chain` take them."""
        names = ("preset", "method", "rings", "placement", "weld", "prune", "symmetry", *_LINE_NAMES)
        options = {name: getattr(self, name) for name in names}
        if self.preset == "default":  # the paper does not refit
            options["refit"] = self.refit
        if threads := preferences().threads:
            options["threads"] = threads
        return options


_TARGET_NAMES = {"ratio": "ratio", "count": "faces_target", "error": "max_error", "screen": "max_error"}


class SimplifyOptions(EngineOptions, KeepOptions, ScreenOptions):
    """One simplified version."""

    target: EnumProperty(name="Target", items=_TARGETS, default="ratio")
    ratio: FloatProperty(
        name="Ratio",
        description="Share of the triangles to keep",
        default=0.5,
        soft_min=0.001,
        soft_max=1.0,
        precision=3,
        subtype="FACTOR",
    )
    faces_target: IntProperty(name="Triangles", description="Triangles to keep", default=1000, soft_min=1)
    max_error: FloatProperty(
        name="Max Error",
        description="Largest deviation from the source, in the scene's units",
        default=0.01,
        soft_min=0.0,
        precision=5,
        subtype="DISTANCE",
    )
    screen_size: FloatProperty(
        name="Size", description="Pixels of the longest side on screen", default=400.0, min=1.0, soft_max=4000.0
    )
    only_selected: BoolProperty(
        name="Only Selected", description="In Edit Mode, simplify the selected faces and leave the others",
        default=True
    )
    in_place: BoolProperty(name="In Place", description="Replace the object's own mesh", default=False)
    all_users: BoolProperty(
        name="All Users",
        description="In place, change every object that shares the mesh; otherwise the object gets a mesh of its own",
        default=False,
    )

    def draw_target(self, layout: bpy.types.UILayout) -> None:
        """Draw the target's kind and its value."""
        row = layout.row(align=True)
        row.use_property_split = False  # four words are wider than the half that it leaves
        row.prop(self, "target", expand=True)
        if self.target == "screen":
            layout.prop(self, "screen_size")
            self.draw_screen(layout)
        else:
            layout.prop(self, _TARGET_NAMES[self.target])

    def screen(self) -> "Screen":
        """Give the picture in which an error is judged."""
        from ..core.screen import Screen

        return Screen(**self.screen_settings())

    def simplify_target(self) -> dict[str, Any]:
        """Give the target as `simplify` takes it."""
        name = _TARGET_NAMES[self.target]
        return {name: getattr(self, name)}

    def expected_triangles(self, now: int) -> int | None:
        """Give the triangles that the target asks for, None if only the engine can tell."""
        return {"ratio": round(now * self.ratio), "count": min(now, self.faces_target)}.get(self.target)


def option_names(*classes: type) -> list[str]:
    """List the names of all options that classes define, each once, what they build on first."""
    found: dict[str, None] = {}
    for one in classes:
        for base in reversed(one.__mro__):
            found.update(dict.fromkeys(get_annotations(base)))
    return list(found)
