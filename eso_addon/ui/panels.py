# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar panels `ESO`: what the mesh has, what it is to become, and what the last run did."""

import textwrap

import bpy

from ..operators import level_slide, shown
from ..operators.level_figures import level_figures
from ..operators.lod_polls import why_not_generate, why_not_update
from ..operators.polls import active_triangles, why_not_in_place, why_not_measure, why_not_simplify
from ..settings.profiles import PROFILES
from .presets import VIEW3D_MT_eso_level_sets, VIEW3D_PT_eso_presets

_STREAM = (
    ("export_mesh.esopm", "Stream Export", "EXPORT"),
    ("import_mesh.esopm", "Stream Import", "IMPORT"),
)
_OVERLAYS = (
    ("weights", "object.eso_weights_show", "Weights", "VPAINT_HLT"),
    ("edges", "object.eso_edges_show", "Edges", "MOD_EDGESPLIT"),
    ("deviation", "object.eso_deviation_show", "Deviation", "DRIVER_DISTANCE"),
)


class _SidebarPanel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "ESO"

    layout: bpy.types.UILayout

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Leave the header as it is."""


class VIEW3D_PT_eso_simplify(_SidebarPanel, bpy.types.Panel):
    """One simplified version."""

    bl_label = "ESO Simplify"

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the icon of the presets."""
        VIEW3D_PT_eso_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the target, the count that it gives, and the button; or how far the run is."""
        layout, settings = self.layout, context.scene.eso_lod
        run = context.window_manager.eso_last_run
        if run.running:
            _draw_progress(layout, run)
            return
        if level_slide.session() is not None:
            _draw_slider(layout, run)
            return
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
        _draw_button(context, layout, "object.eso_level_slide", "Level Slider", "ARROW_LEFTRIGHT",
                     why_not_simplify(context), told=False)  # fmt: skip


class VIEW3D_PT_eso_keep(_SidebarPanel, bpy.types.Panel):
    """What a simplified mesh keeps."""

    bl_label = "What to Keep"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the options that both share."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        context.scene.eso_lod.draw_keep(self.layout)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Stay away where nothing can be chosen."""
        return hasattr(context.scene.eso_lod, "draw_keep")


class VIEW3D_PT_eso_levels(_SidebarPanel, bpy.types.Panel):
    """A chain of levels."""

    bl_label = "Levels of Detail"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list of levels and the button."""
        layout, settings = self.layout, context.scene.eso_lod
        layout.enabled = not context.window_manager.eso_last_run.running and level_slide.session() is None
        layout.use_property_decorate = False
        row = layout.row(align=True)
        row.menu(VIEW3D_MT_eso_level_sets.bl_idname, icon="PRESET")
        row.operator("scene.eso_level_add", text="", icon="ADD")
        row.operator("scene.eso_level_remove", text="", icon="REMOVE")
        column = layout.column(align=True)
        settings.draw_rows(column, level_figures(context))
        layout.use_property_split = True
        settings.draw_levels(layout, as_text=False)
        reason = why_not_generate(context)
        _draw_button(context, layout, "object.eso_lod_generate", "Generate LODs", "OUTLINER_COLLECTION", reason)
        reason = why_not_update(context)
        _draw_button(context, layout, "object.eso_lod_update", "Update LODs", "FILE_REFRESH", reason, scale=1.0,
                     told=False)  # fmt: skip
        profile = PROFILES[settings.profile]
        offers = ((profile.hull, "object.eso_lod_hulls", "Collision Hulls", "MESH_ICOSPHERE"),
                  (profile.normal_maps, "object.eso_lod_bake", "Bake Normals", "RENDER_STILL"))  # fmt: skip
        for used, operator, text, icon in offers:
            if used:
                _draw_button(context, layout, operator, text, icon, reason, scale=1.0, told=False)
        _draw_button(context, layout, "object.eso_lod_export", "Export LODs", "EXPORT", reason, scale=1.0)


class VIEW3D_PT_eso_places(_SidebarPanel, bpy.types.Panel):
    """Which meshes get levels, and where they go."""

    bl_label = "Meshes and Places"
    bl_parent_id = "VIEW3D_PT_eso_levels"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the options of the levels that are seldom changed."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        context.scene.eso_lod.draw_places(self.layout)


class VIEW3D_PT_eso_weights(_SidebarPanel, bpy.types.Panel):
    """How the engine works."""

    bl_label = "Method and Weights"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the options that both share."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        context.scene.eso_lod.draw_engine(self.layout)


class VIEW3D_PT_eso_measure(_SidebarPanel, bpy.types.Panel):
    """Deviations, and why they are where they are."""

    bl_label = "Measure and See"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the buttons."""
        layout = self.layout
        layout.enabled = not context.window_manager.eso_last_run.running
        _draw_button(context, layout, "object.eso_measure", "Measure", "DRIVER_DISTANCE", why_not_measure(context))
        row = layout.row(align=True)
        for kind, operator, text, icon in _OVERLAYS:
            if shown.is_shown(kind, context.active_object):
                row.operator("object.eso_overlay_hide", text=text, icon=icon, depress=True)
            else:
                row.operator(operator, text=text, icon=icon)


class VIEW3D_PT_eso_stream(_SidebarPanel, bpy.types.Panel):
    """Progressive streams."""

    bl_label = "Stream"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Stay away where streams cannot be written."""
        return any(_exists(operator) for operator, _, _ in _STREAM)

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the buttons."""
        for operator, text, icon in _STREAM:
            if _exists(operator):
                self.layout.operator(operator, text=text, icon=icon)


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
    VIEW3D_PT_eso_keep,
    VIEW3D_PT_eso_weights,
    VIEW3D_PT_eso_levels,
    VIEW3D_PT_eso_places,
    VIEW3D_PT_eso_last_run,
    VIEW3D_PT_eso_measure,
    VIEW3D_PT_eso_stream,
)


def register() -> None:
    """Register the panels."""
    for cls in _PANELS:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed(_PANELS):
        bpy.utils.unregister_class(cls)


def _exists(operator: str) -> bool:
    """Tell whether an operator is registered."""
    group, name = operator.split(".")
    return hasattr(bpy.types, f"{group.upper()}_OT_{name}")


def _draw_progress(layout: bpy.types.UILayout, run: bpy.types.PropertyGroup) -> None:
    """Draw how far the run is, and how to stop it."""
    column = layout.column()
    column.label(text=run.running)
    column.progress(factor=run.progress, text=f"{run.progress:.0%}")
    column.label(text="Stopping" if run.stopping else "Cancel", icon="EVENT_ESC")


def _draw_slider(layout: bpy.types.UILayout, run: bpy.types.PropertyGroup) -> None:
    """Draw the level slider and its two ends."""
    slider = level_slide.session()
    column = layout.column()
    column.scale_y = 1.4
    column.prop(run, "level", slider=True)
    _draw_pair(layout.column(), "Triangles", f"{slider.faces:,}" if slider else "")
    row = layout.row(align=True)
    row.operator("object.eso_level_slide_end", text="Keep", icon="CHECKMARK").keep = True
    row.operator("object.eso_level_slide_end", text="Cancel", icon="X").keep = False


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
    context: bpy.types.Context,
    layout: bpy.types.UILayout,
    operator: str,
    text: str,
    icon: str,
    reason: str,
    *,
    scale: float = 1.4,
    told: bool = True,
) -> None:
    """Draw an operator's button with the settings handed over, greyed with the reason below if it cannot run."""
    row = layout.row()
    row.scale_y = scale
    row.enabled = not reason
    context.scene.eso_lod.hand_over(row.operator(operator, text=text, icon=icon))
    if reason and told:
        column = layout.column(align=True)
        column.active = False
        _draw_text(column, bpy.app.translations.pgettext_iface(reason), context)


def _draw_text(layout: bpy.types.UILayout, text: str, context: bpy.types.Context) -> None:
    """Draw a text in as many lines as the panel's width needs."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    characters = max(int((context.region.width / scale - 45) / 6), 12)
    for line in textwrap.wrap(text, characters):
        layout.label(text=line, translate=False)
