# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels draw into a stand-in for Blender's layout; how they look is seen in a window."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from eso_addon import operators, settings, ui
from eso_addon import settings as settings_package
from eso_addon.core.errors import MeshError
from eso_addon.settings.level_list import MOST
from eso_addon.settings.level_text import TEXT_OF
from eso_addon.ui import menus, panels, presets
from tests.bridge.blender_scenes import activate, add_cube, add_sphere, linked_from_library


class Layout:
    """Writes down what is drawn."""

    def __init__(self, drawn: list[tuple[str, str, bool]]) -> None:
        self.drawn = drawn
        self.enabled = True

    def row(self, **_: object) -> "Layout":
        return Layout(self.drawn)

    column = split = row

    def label(self, text: str = "", **_: object) -> None:
        self.drawn.append(("label", text, True))

    def progress(self, factor: float, text: str) -> None:
        self.drawn.append(("progress", text, True))

    def prop(self, data: bpy.types.bpy_struct, name: str, **_: object) -> None:
        assert name in data.bl_rna.properties
        self.drawn.append(("prop", name, True))

    def prop_search(self, data: bpy.types.bpy_struct, name: str, *_: object) -> None:
        self.prop(data, name)

    def operator(self, name: str, **_: object) -> SimpleNamespace:
        self.drawn.append(("operator", name, self.enabled))
        group, word = name.split(".")
        return SimpleNamespace(bl_rna=getattr(getattr(bpy.ops, group), word).get_rna_type())

    def menu(self, name: str, **_: object) -> None:
        self.drawn.append(("menu", name, True))

    def separator(self) -> None:
        pass


def drawn_by(panel: type) -> list[tuple[str, str, bool]]:
    drawn: list[tuple[str, str, bool]] = []
    context = SimpleNamespace(
        **{name: getattr(bpy.context, name) for name in
           ("scene", "mode", "active_object", "selected_objects", "view_layer", "window_manager", "preferences",
            "collection")},
        region=SimpleNamespace(width=280),
    )  # fmt: skip
    panel.draw(SimpleNamespace(layout=Layout(drawn)), context)
    return drawn


def labels(panel: type) -> str:
    return " ".join(text for kind, text, _ in drawn_by(panel) if kind == "label")


def buttons(panel: type) -> dict[str, bool]:
    return {name: enabled for kind, name, enabled in drawn_by(panel) if kind == "operator"}


pytestmark = pytest.mark.usefixtures("addon")


@pytest.mark.parametrize("panel", panels._PANELS)
def test_every_panel_draws_with_and_without_an_object(panel: type) -> None:
    bpy.context.window_manager.eso_last_run.show("Simplified Ball", "error 0.1")
    assert drawn_by(panel)
    add_sphere()
    assert drawn_by(panel)


def test_counts_before_and_after_are_shown_before_the_click() -> None:
    add_sphere()
    bpy.context.scene.eso_lod.ratio = 0.25
    assert "1,280" in labels(panels.VIEW3D_PT_eso_simplify)
    assert "320" in labels(panels.VIEW3D_PT_eso_simplify)
    bpy.context.scene.eso_lod.target = "count"
    assert "1,000" in labels(panels.VIEW3D_PT_eso_simplify)
    bpy.context.scene.eso_lod.target = "error"
    assert "as the error allows" in labels(panels.VIEW3D_PT_eso_simplify)


def test_what_cannot_run_is_greyed_with_the_reason() -> None:
    assert buttons(panels.VIEW3D_PT_eso_simplify)["object.eso_simplify"] is False
    assert "No active object" in labels(panels.VIEW3D_PT_eso_simplify)
    assert buttons(panels.VIEW3D_PT_eso_levels)["object.eso_lod_generate"] is False
    assert buttons(panels.VIEW3D_PT_eso_measure)["object.eso_measure"] is False
    add_cube()
    assert buttons(panels.VIEW3D_PT_eso_simplify)["object.eso_simplify"] is True
    assert buttons(panels.VIEW3D_PT_eso_levels)["object.eso_lod_generate"] is True
    assert "Select the original" in labels(panels.VIEW3D_PT_eso_measure)


def test_in_place_is_greyed_with_the_reason_for_linked_data(tmp_path: Path) -> None:
    add_cube("Far")
    obj = linked_from_library(tmp_path, "objects", "Far")
    bpy.context.scene.collection.objects.link(obj)
    activate(obj)
    assert buttons(panels.VIEW3D_PT_eso_simplify)["object.eso_simplify"] is True
    bpy.context.scene.eso_lod.in_place = True
    assert buttons(panels.VIEW3D_PT_eso_simplify)["object.eso_simplify"] is False
    assert "make it local" in labels(panels.VIEW3D_PT_eso_simplify)


def test_a_run_that_goes_on_is_a_bar_in_place_of_the_buttons() -> None:
    add_cube()
    run = bpy.context.window_manager.eso_last_run
    run.running, run.progress = "ESO Simplify", 0.25
    assert ("progress", "25%", True) in drawn_by(panels.VIEW3D_PT_eso_simplify)
    assert buttons(panels.VIEW3D_PT_eso_simplify) == {}
    run.running = ""
    assert "object.eso_simplify" in buttons(panels.VIEW3D_PT_eso_simplify)


def test_levels_are_rows_of_the_text_that_operators_take() -> None:
    settings = bpy.context.scene.eso_lod
    settings.ratios = "0.5, 0.25"
    assert list(settings.row_ratio)[:3] == pytest.approx([0.5, 0.25, 0])
    settings.row_ratio[1] = 0.125
    assert settings.ratios == "0.5, 0.125"
    bpy.ops.scene.eso_level_add()
    assert settings.ratios == "0.5, 0.125, 0.0625"
    bpy.ops.scene.eso_level_remove()
    bpy.ops.scene.eso_level_remove()
    bpy.ops.scene.eso_level_remove()
    assert settings.ratios == "0.5"
    bpy.ops.scene.eso_level_set(name="Unity")
    assert settings.profile == "unity"
    assert len(settings.level_values()) == 4


@pytest.mark.parametrize(("kind", "text"), [
    ("count", "inf"), ("screen", "inf, 3"), ("budget", "1e400"), ("ratio", "nan"), ("ratio", "0.5, x"), ("error", "")])
def test_levels_that_cannot_be_read_are_shown_as_text(kind: str, text: str) -> None:
    settings = bpy.context.scene.eso_lod
    settings.levels_by = kind
    setattr(settings, TEXT_OF[kind], text)
    assert list(getattr(settings, f"row_{kind}")) == [0] * MOST
    assert settings.level_values() == []
    drawn = drawn_by(panels.VIEW3D_PT_eso_levels)
    assert any(TEXT_OF[kind] in line for line in drawn)
    with pytest.raises(MeshError, match="write numbers with commas between"):
        settings.level_goals()
    settings.add_level()
    assert len(settings.level_values()) == 1


def test_rows_hold_large_numbers_and_drop_no_levels() -> None:
    settings = bpy.context.scene.eso_lod
    settings.faces_targets = "5000000000, 100"
    assert list(settings.row_count)[:2] == [2**31 - 1, 100]
    settings.row_count[1] = 50
    assert settings.faces_targets == "5000000000, 50"
    settings.ratios = "0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1"
    settings.row_ratio[0] = 0.95
    assert settings.ratios == "0.95, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1"
    bpy.ops.scene.eso_level_add()
    assert len(settings.level_values()) == 9
    rows = [name for kind, name, _ in drawn_by(panels.VIEW3D_PT_eso_levels) if (kind, name) == ("prop", "row_ratio")]
    assert len(rows) == MOST
    assert "+ 1" in labels(panels.VIEW3D_PT_eso_levels)


@pytest.mark.parametrize("text", ["inf", "nan, 100", "-inf", "1e400", "100, x"])
@pytest.mark.parametrize("kind", ["ratio", "count", "error", "screen", "budget"])
def test_rows_of_what_is_no_number_are_left_out(kind: str, text: str) -> None:
    settings = bpy.context.scene.eso_lod
    settings.levels_by = kind
    setattr(settings, TEXT_OF[kind], text)
    assert list(getattr(settings, f"row_{kind}"))[1:] == [0] * 7
    assert drawn_by(panels.VIEW3D_PT_eso_levels)
    add_sphere()
    with pytest.raises(RuntimeError, match="(?i)cannot be read|write numbers|number"):
        bpy.ops.object.eso_lod_generate(levels_by=kind, **{TEXT_OF[kind]: text})


def test_a_preset_holds_the_whole_panel_but_for_what_is_of_one_file() -> None:
    kept = {value.removeprefix("settings.") for value in presets.SCENE_OT_eso_preset_add.preset_values}
    shown = {name for name in bpy.context.scene.eso_lod.bl_rna.properties.keys()  # noqa: SIM118 - no dictionary
             if not name.startswith("row_")} - {"rna_type", "name"}
    assert shown - kept == {"vertex_group", "scope", "source_collection", "collection"}
    assert kept <= shown


def test_figures_stand_beside_the_levels_before_and_after() -> None:
    add_sphere()
    settings = bpy.context.scene.eso_lod
    settings.ratios = "0.5, 0.25"
    assert "640" in labels(panels.VIEW3D_PT_eso_levels)
    bpy.ops.object.eso_lod_generate(ratios="0.5, 0.25")
    assert "±" in labels(panels.VIEW3D_PT_eso_levels)


@pytest.mark.parametrize("name", ["Prop", "Character", "Scan", "Hard_Surface", "Web", "Paper"])
def test_factory_presets_set_the_panel(name: str) -> None:
    settings = bpy.context.scene.eso_lod
    settings.rings, settings.weld = 7, False
    folder = Path(settings_package.__file__).parent.parent / "presets" / "eso_lod"
    exec(compile((folder / f"{name}.py").read_text(encoding="utf-8"), name, "exec"), {})
    assert settings.weld
    assert settings.rings != 7
    assert (settings.preset == "paper") == (name == "Paper")


def test_the_last_run_is_shown() -> None:
    bpy.context.window_manager.property_unset("eso_last_run")  # the window outlives the file
    assert not panels.VIEW3D_PT_eso_last_run.poll(bpy.context)
    add_sphere()
    bpy.ops.object.eso_simplify(ratio=0.5)
    assert panels.VIEW3D_PT_eso_last_run.poll(bpy.context)
    shown = labels(panels.VIEW3D_PT_eso_last_run)
    assert "1,280 to" in shown
    assert "error" in shown


def test_settings_are_handed_over_by_name() -> None:
    group = bpy.context.scene.eso_lod
    for operator in (bpy.ops.object.eso_simplify, bpy.ops.object.eso_lod_generate):
        own = {name for name, kind in operator.get_rna_type().properties.items() if not kind.is_readonly}
        assert {"method", "rings"} <= own <= set(group.bl_rna.properties.keys())
    group.ratio, group.method, group.in_place = 0.125, "qem", True
    target = SimpleNamespace(bl_rna=bpy.ops.object.eso_simplify.get_rna_type())
    group.hand_over(target)
    assert (target.ratio, target.method, target.in_place) == (0.125, "qem", True)


def test_the_menu_names_operators_that_exist() -> None:
    drawn: list[tuple[str, str, bool]] = []
    menus.VIEW3D_MT_eso_lod.draw(SimpleNamespace(layout=Layout(drawn)), bpy.context)
    assert [name for _, name, _ in drawn] == list(menus.OPERATORS)
    menus.draw_entry(SimpleNamespace(layout=Layout(drawn)), bpy.context)
    assert drawn[-1][:2] == ("menu", "VIEW3D_MT_eso_lod")


def test_both_object_menus_have_the_entry_once() -> None:
    for menu in (bpy.types.VIEW3D_MT_object, bpy.types.VIEW3D_MT_object_context_menu):
        assert menu._dyn_ui_initialize().count(menus.draw_entry) == 1


def test_switching_off_and_on_leaves_nothing_behind() -> None:
    parts = (settings, operators, ui)
    for part in reversed(parts):
        part.unregister()
    for menu in (bpy.types.VIEW3D_MT_object, bpy.types.VIEW3D_MT_object_context_menu):
        assert menus.draw_entry not in menu._dyn_ui_initialize()
    assert not hasattr(bpy.types.Scene, "eso_lod")
    assert not hasattr(bpy.types.WindowManager, "eso_last_run")
    assert not hasattr(bpy.types, "OBJECT_OT_eso_simplify")
    assert not [h for h in bpy.app.handlers.load_pre if h.__module__.startswith("eso_addon")]
    for part in parts:
        part.register()
    assert bpy.ops.object.eso_simplify.idname() == "OBJECT_OT_eso_simplify"
