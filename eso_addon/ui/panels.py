# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar panel `ESO`: what the mesh has, what it is to become, and what the last run did."""

import textwrap

import bpy

from ..operators.polls import active_triangles, why_not_in_place, why_not_measure, why_not_simplify


class _SidebarPanel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "ESO"


class VIEW3D_PT_eso_simplify(_SidebarPanel, bpy.types.Panel):
    """One simplified version."""

    bl_label = "ESO Simplify"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the target, the count that it gives, and the button."""
        layout, settings = self.layout, context.scene.eso_lod
        layout.use_property_split, layout.use_property_decorate = True, False
        reason = why_not_simplify(context)
        if not reason and context.mode == "OBJECT":  # Edit Mode knows its count only when it is left
            _draw_counts(layout, context)
        settings.draw_target(layout)
        layout.prop(settings, "in_place")
        if settings.in_place:
            layout.prop(settings, "all_users")
            reason = reason or why_not_in_place(context)
        _draw_button(context, layout, "object.eso_simplify", "Simplify", "MOD_DECIM", reason)


class VIEW3D_PT_eso_levels(_SidebarPanel, bpy.types.Panel):
    """A chain of levels."""

    bl_label = "Levels of Detail"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list of levels and the button."""
        layout, settings = self.layout, context.scene.eso_lod
        layout.use_property_split, layout.use_property_decorate = True, False
        settings.draw_levels(layout)
        reason = why_not_simplify(context)
        _draw_button(context, layout, "object.eso_lod_generate", "Generate LODs", "OUTLINER_COLLECTION", reason)


class VIEW3D_PT_eso_weights(_SidebarPanel, bpy.types.Panel):
    """How the engine works."""

    bl_label = "Method and Weights"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the options that both share."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        context.scene.eso_lod.draw_engine(self.layout)


class VIEW3D_PT_eso_measure(_SidebarPanel, bpy.types.Panel):
    """Deviations and the last run."""

    bl_label = "Measure"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the button."""
        _draw_button(context, self.layout, "object.eso_measure", "Measure", "DRIVER_DISTANCE", why_not_measure(context))


class VIEW3D_PT_eso_last_run(_SidebarPanel, bpy.types.Panel):
    """What the last run reported."""

    bl_label = "Last Run"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Stay away until something was run."""
        return bool(context.window_manager.eso_last_run.title)

    def draw(self, context: bpy.types.Context) -> None:
        """List the figures, broken to the panel's width."""
        last_run = context.window_manager.eso_last_run
        column = self.layout.column(align=True)
        for line in (last_run.title, *last_run.lines.split("\n")):
            _draw_text(column, line, context)


_PANELS = (
    VIEW3D_PT_eso_simplify,
    VIEW3D_PT_eso_levels,
    VIEW3D_PT_eso_weights,
    VIEW3D_PT_eso_measure,
    VIEW3D_PT_eso_last_run,
)


def register() -> None:
    """Register the panels."""
    for cls in _PANELS:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed(_PANELS):
        bpy.utils.unregister_class(cls)


def _draw_counts(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    settings = context.scene.eso_lod
    now = active_triangles(context, with_modifiers=settings.apply_modifiers)
    then = settings.expected_triangles(now)
    column = layout.column(align=True)
    _draw_pair(column, "Triangles", f"{now:,}")
    _draw_pair(column, "Result", "as the error allows" if then is None else f"{then:,}")


def _draw_pair(layout: bpy.types.UILayout, name: str, value: str) -> None:
    """Draw a line that looks like a property that cannot be changed."""
    split = layout.split(factor=0.4)
    split.alignment = "RIGHT"
    split.label(text=name)
    split.label(text=value)


def _draw_button(
    context: bpy.types.Context, layout: bpy.types.UILayout, operator: str, text: str, icon: str, reason: str
) -> None:
    """Draw an operator's button with the settings handed over, greyed with the reason below if it cannot run."""
    row = layout.row()
    row.scale_y = 1.4
    row.enabled = not reason
    context.scene.eso_lod.hand_over(row.operator(operator, text=text, icon=icon))
    if reason:
        column = layout.column(align=True)
        column.active = False
        _draw_text(column, reason, context)


def _draw_text(layout: bpy.types.UILayout, text: str, context: bpy.types.Context) -> None:
    """Draw a text in as many lines as the panel's width needs."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    characters = max(int((context.region.width / scale - 45) / 6.5), 12)
    for line in textwrap.wrap(text, characters):
        layout.label(text=line)
