# SPDX-License-Identifier: GPL-3.0-or-later
"""`make gui`: what an artist does with the add-on, done in a real window; pictures and asserts after each step."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import blf
import bpy
import numpy as np
import window as w
from window import Steps

FIGURES: dict[str, Any] = {}
BLANK = 12  # grey levels that a region may differ by and still show nothing new


def fresh(levels: int = 2) -> bpy.types.Object:
    """Start with a monkey of 968 * 4 ** levels triangles, seen large."""
    bpy.ops.object.select_all(action="DESELECT")
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    for collection in list(bpy.data.collections)[1:]:
        bpy.data.collections.remove(collection)
    bpy.ops.mesh.primitive_monkey_add(rotation=(0.1, 0, 0.6))
    obj = bpy.context.object
    for kind in ("SUBSURF", "TRIANGULATE"):
        modifier = obj.modifiers.new(kind, kind)
        if kind == "SUBSURF":
            modifier.levels = levels
        bpy.ops.object.modifier_apply(modifier=kind)
    bpy.ops.object.shade_flat() if levels < 3 else bpy.ops.object.shade_smooth()
    w.look_at_object()
    last_run().title = ""
    bpy.ops.ed.undo_push(message="A monkey")
    return obj


def addon(path: str) -> Any:  # noqa: ANN401 - a module
    """Give a module of the installed add-on."""
    return sys.modules[f"bl_ext.user_default.eso_lod.eso_addon.{path}"]


def state() -> dict[str, tuple[int, bool]]:
    """Say what is in the file: meshes with their triangles, and whether they are selected."""
    return {o.name: (len(o.data.polygons), o.select_get()) for o in bpy.data.objects if o.type == "MESH"}


def names() -> set[str]:
    """Give the names of all objects."""
    return {obj.name for obj in bpy.data.objects}


def visible() -> set[str]:
    """Give the names of the objects that are not hidden."""
    return {obj.name for obj in bpy.context.view_layer.objects if obj.visible_get()}


def colorful(image: np.ndarray) -> float:
    """Give the share of pixels with a strong colour."""
    pixels = image.reshape(-1, 3).astype(int)
    return float(((pixels.max(axis=1) - pixels.min(axis=1)) > 60).mean())


def is_open(editor: str) -> bool:
    """Tell whether the window shows an editor."""
    return any(area.type == editor for area in w.window().screen.areas)


def last_run() -> Any:  # noqa: ANN401
    """Give what the panel says of the last run."""
    return bpy.context.window_manager.eso_last_run


def replace_method(cls: type, name: str, method: Callable[..., Any]) -> Callable[[], None]:
    """Put a method in the place of another; give the way back."""
    plain = getattr(cls, name)
    setattr(cls, name, method)
    return lambda: setattr(cls, name, plain)


def timer_calls(cls: Any, times: list[float]) -> Callable[[], None]:  # noqa: ANN401
    """Write down when the modal timer calls; give the way back."""
    plain = cls.modal

    def modal(self: Any, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:  # noqa: ANN401
        if event.type == "TIMER":
            times.append(time.perf_counter())
        return plain(self, context, event)

    return replace_method(cls, "modal", modal)


def execute_seconds(cls: Any, seconds: list[float]) -> Callable[[], None]:  # noqa: ANN401
    """Write down how long `execute` lasts; give the way back."""
    plain = cls.execute

    def execute(self: Any, context: bpy.types.Context) -> set[str]:  # noqa: ANN401
        begun = time.perf_counter()
        result = plain(self, context)
        seconds.append(time.perf_counter() - begun)
        return result

    return replace_method(cls, "execute", execute)


def scene_panel() -> Steps:
    """See that the sidebar's tab is there, and that its words fit their columns."""
    fresh()
    view = bpy.context.preferences.view
    view.smooth_view, view.filebrowser_display_type = 0, "SCREEN"
    yield from w.still()
    before = w.part(w.capture(), w.view())
    yield from w.sidebar()
    yield from w.still()
    area = w.region("UI")
    after = w.part(w.picture("panel"), w.view())
    changed = np.abs(after.astype(int) - before)[:, -area.width :].max(axis=2) > BLANK
    assert changed.mean() > 0.2, "the sidebar is not there"
    yield from words_fit(area.width)


def words_fit(width: int) -> Steps:
    """Assert that no property's name is wider than its column."""
    scale = bpy.context.preferences.system.ui_scale
    settings = bpy.context.scene.eso_lod
    blf.size(0, 11 * scale)
    inner = width - 45 * scale  # without borders and tabs
    too_wide = []
    for kind in settings.bl_rna.properties:
        if kind.is_hidden or kind.identifier in {"rna_type", "name"} or kind.identifier.startswith("row_"):
            continue
        beside = kind.type == "BOOLEAN"  # a box stands before its words
        room = inner * 0.6 - 30 * scale if beside else inner * 0.4
        if blf.dimensions(0, kind.name)[0] > room:
            too_wide.append(kind.name)
    assert not too_wide, f"wider than their column: {too_wide}"
    yield 0.0


def scene_simplify() -> Steps:
    """Simplify with a click: counts stand before and after, one undo takes it back."""
    count = len(fresh().data.polygons)
    yield from w.press_button("object.eso_simplify")
    yield from w.wait_for(lambda: "Suzanne_ESO" in names(), 30, "the result")
    yield from w.clear_sidebar()
    w.picture("simplify")
    assert visible() == {"Suzanne_ESO"}, "both stand in the same place"
    assert state()["Suzanne_ESO"][0] == count // 2, state()
    assert f"{count:,} to {count // 2:,} triangles" in last_run().lines
    yield from w.key("Z", ctrl=True)
    assert names() == visible() == {"Suzanne"}, names()
    yield from w.key("Z", ctrl=True, shift=True)
    assert names() == {"Suzanne", "Suzanne_ESO"}, names()


def scene_long_work() -> Steps:
    """Simplify a million triangles: the bar moves, the window lives, Esc leaves everything as it was."""
    obj = fresh(5)
    FIGURES["triangles of the long work"] = len(obj.data.polygons)
    before = state()
    calls: list[float] = []
    restore = timer_calls(bpy.types.OBJECT_OT_eso_simplify, calls)
    yield from w.press_button("object.eso_simplify")
    yield from w.wait_for(lambda: last_run().progress > 0.02, 120, "the first progress")
    yield from w.clear_sidebar()
    first = w.part(w.picture("progress"), w.region("UI"))
    quiet = len(calls)  # the pictures above held the window up, not the add-on
    begun, (busy, own) = time.perf_counter(), w.work_done()
    yield from w.wait_for(lambda: last_run().progress > 0.3, 240, "more progress")
    yield 1.5
    gaps = np.diff(calls[quiet + 2 :])
    others = np.subtract(w.work_done(), (busy, own)) @ (1, -1) / (time.perf_counter() - begun)
    second = w.part(w.capture(), w.region("UI"))
    assert (np.abs(first.astype(int) - second).max(axis=2) > BLANK).sum() > 200, "the bar did not move"
    yield from w.key("ESC")
    yield from w.wait_for(lambda: not last_run().running, 30, "the end after Esc")
    restore()
    w.picture("cancelled")
    assert state() == before, "Esc changed something"
    figures = {f"p{part}": 1000 * float(np.percentile(gaps, part)) for part in (50, 95, 99)}
    FIGURES["milliseconds between modal timer calls"] = {**figures, "max": 1000 * float(gaps.max()), "n": len(gaps),
                                                       "cores that other processes had": round(float(others), 2)}
    assert figures["p95"] <= 50, FIGURES["milliseconds between modal timer calls"]


def scene_redo() -> Steps:
    """Drag a ratio in the redo panel: it replays quickly, and as a fresh run would give it."""
    obj = fresh(3)
    modifier = obj.modifiers.new("More", "SUBSURF")
    modifier.levels = 1
    bpy.ops.object.modifier_apply(modifier="More")
    decimate = obj.modifiers.new("Fewer", "DECIMATE")
    decimate.ratio = 100_000 / (2 * len(obj.data.polygons))
    bpy.ops.object.modifier_apply(modifier="Fewer")
    bpy.ops.ed.undo_push(message="A hundred thousand")
    bpy.context.scene.eso_lod.refit = False
    yield from w.press_button("object.eso_simplify")
    yield from w.wait_for(lambda: "Suzanne_ESO" in names(), 60, "the result")
    before = len(bpy.data.objects["Suzanne_ESO"].data.polygons)
    seconds: list[float] = []
    restore = execute_seconds(bpy.types.OBJECT_OT_eso_simplify, seconds)
    yield 1.0
    for _ in range(3):
        hud = w.region("HUD")
        if hud.height < 60:  # only its title is there
            yield from w.click(hud.x + 60, hud.y + hud.height - 12)
            yield 1.5
    hud = w.region("HUD")
    start = hud.x + hud.width * 0.8, hud.y + hud.height - 89  # the fourth row: operators' properties have no path
    yield from w.drag(start, (start[0] - 50, start[1]), moves=6, rest=0.8)
    yield 1.0
    restore()
    w.picture("redo")
    bpy.context.scene.eso_lod.refit = True
    result = bpy.data.objects["Suzanne_ESO"]
    yield from w.wait_for(lambda: "follows" not in last_run().lines, 30, "the error that follows")
    after = len(result.data.polygons)
    assert seconds, "nothing was redone"
    assert after != before
    FIGURES["milliseconds inside execute when redone"] = {
        "triangles": len(bpy.data.objects["Suzanne"].data.polygons), "all": [round(1000 * s) for s in seconds],
        "median": 1000 * float(np.median(seconds)),
    }  # fmt: skip
    assert names() == {"Suzanne", "Suzanne_ESO"}, names()
    yield from same_as_fresh(result)


def same_as_fresh(replayed: bpy.types.Object) -> Steps:
    """Assert that a run from nothing gives the same mesh to the last bit."""
    addon("jobs.replay").forget()
    source = bpy.data.objects["Suzanne"]
    bpy.context.view_layer.objects.active = source
    replayed.data.calc_loop_triangles()  # quads that did not change are still there
    bpy.ops.object.eso_simplify(target="count", faces_target=len(replayed.data.loop_triangles), refit=False)
    again = bpy.context.object
    assert again != replayed
    for name in ("position", ".corner_vert"):
        one, other = (obj.data.attributes[name] for obj in (replayed, again))
        kind, width = ("value", 1) if name == ".corner_vert" else ("vector", 3)
        arrays = [np.zeros(len(a.data) * width, np.int32 if width == 1 else np.float32) for a in (one, other)]
        for attribute, array in zip((one, other), arrays, strict=True):
            attribute.data.foreach_get(kind, array)
        assert np.array_equal(*arrays), f"{name} differs from a fresh run"
    yield 0.2


def scene_slider() -> Steps:
    """Drag through the levels: drawn while dragged, written where it rests, gone with Esc."""
    fresh(4)
    decimate = bpy.context.object.modifiers.new("Fewer", "DECIMATE")
    decimate.ratio = 100_000 / len(bpy.context.object.data.polygons)
    bpy.ops.object.modifier_apply(modifier="Fewer")
    bpy.ops.ed.undo_push(message="A hundred thousand")
    before = state()
    yield from w.press_button("object.eso_level_slide")
    slide = addon("operators.level_slide")
    yield from w.wait_for(lambda: slide.session() is not None, 60, "the slider")
    yield 0.6
    found: list[tuple[int, int]] = []
    yield from w.find("eso_last_run.level", found, x=0.9)
    x, y = found[0]
    w.move(x, y)
    w.press("LEFTMOUSE", x, y)
    yield 0.1
    for step in range(1, 16):
        w.move(x - 9 * step, y)
        yield 0.08
    dragged = w.part(w.picture("slider"), w.region("WINDOW"))
    w.press("LEFTMOUSE", x - 135, y, "RELEASE")
    yield from w.wait_for(lambda: len(names()) == 2, 5, "the level to be written")
    yield 0.5
    written = w.part(w.picture("slider_written"), w.region("WINDOW"))
    session = slide.session()
    FIGURES["milliseconds inside the slider's update callback"] = {
        "triangles": before["Suzanne"][0], "median": float(np.median(session.milliseconds)),
        "p95": float(np.percentile(session.milliseconds, 95)), "max": max(session.milliseconds),
        "n": len(session.milliseconds),
    }  # fmt: skip
    assert len(session.milliseconds) > 3, "the slider was not dragged"
    assert (np.abs(dragged.astype(int) - written).max(axis=2) > 40).mean() < 0.15, "the written level looks different"
    yield from w.key("ESC")
    yield from w.wait_for(lambda: slide.session() is None, 5, "the end of the slider")
    assert state() == before, (state(), before)
    yield from w.press_button("object.eso_level_slide")
    yield from w.wait_for(lambda: slide.session() is not None, 60, "the slider again")
    bpy.context.window_manager.eso_last_run.level = 0.4
    yield 0.8
    yield from w.press_button("object.eso_level_slide_end", x=0.2)
    yield from w.wait_for(lambda: slide.session() is None, 5, "the end of the slider")
    assert len(names()) == 2, names()
    yield from w.key("Z", ctrl=True)
    assert names() == {"Suzanne"}, "one step of undo"


def scene_overlays() -> Steps:
    """See weights, edges and deviation in colours."""
    fresh()
    yield from w.still()
    plain = colorful(w.part(w.capture(), w.region("WINDOW")))
    for kind, operator, x in (("weights", "object.eso_weights_show", 0.2), ("edges", "object.eso_edges_show", 0.5)):
        yield from w.press_button(operator, x=x)
        yield from w.wait_for(lambda kind=kind: addon("operators.shown").is_shown(kind, bpy.context.object), 20, kind)
        yield from w.clear_sidebar()
        share = colorful(w.part(w.picture(kind), w.region("WINDOW"))) - plain
        assert share > (0.02 if kind == "weights" else 2e-4), (kind, share)  # lines are thin
    assert "eso_weight" in bpy.context.object.data.attributes
    bpy.context.scene.eso_lod.ratio = 0.05
    yield from w.press_button("object.eso_simplify")
    yield from w.wait_for(lambda: "Suzanne_ESO" in names(), 30, "the result")
    bpy.data.objects["Suzanne"].hide_set(True)
    yield from w.press_button("object.eso_deviation_show", x=0.85)
    yield from w.wait_for(
        lambda: addon("operators.shown").is_shown("deviation", bpy.context.object), 30, "the deviation"
    )
    yield from w.clear_sidebar()
    assert colorful(w.part(w.picture("deviation"), w.region("WINDOW"))) > plain + 0.005
    yield from w.press_button("object.eso_overlay_hide", x=0.85)
    bpy.context.scene.eso_lod.ratio = 0.5
    assert addon("operators.shown").shown() is None


def scene_measure() -> Steps:
    """Measure how far the result is from its original."""
    fresh()
    yield from w.press_button("object.eso_simplify")
    yield from w.wait_for(lambda: "Suzanne_ESO" in names(), 30, "the result")
    yield from w.press_button("bpy.ops.object.eso_measure")
    yield from w.wait_for(lambda: "against" in last_run().title, 60, "the figures")
    yield from w.clear_sidebar()
    w.picture("measure")
    assert "RMS" in last_run().lines


def scene_six_clicks() -> Steps:
    """Go from the installed add-on to exported Unity LODs in six clicks."""
    fresh()
    w.region("UI").active_panel_category = "Item"
    bpy.ops.ed.undo_push(message="Start")
    yield 0.5
    clicks = 0
    home = Path.home()
    for old in home.glob("*.fbx"):
        old.unlink()
    yield from w.click(*last_tab())
    clicks += 1
    yield 0.5
    assert w.region("UI").active_panel_category == "ESO", w.region("UI").active_panel_category
    w.picture("step1_tab")
    found: list[tuple[int, int]] = []
    yield from w.find("bpy.ops.scene.eso_level_add", found, x=0.86)
    before = w.capture()
    yield from w.click(found[0][0] - 120, found[0][1])
    clicks += 1
    w.picture("step2_menu")
    yield from w.click(*row_of_menu(before, w.capture(), 1, 6))
    clicks += 1
    yield 0.5
    assert bpy.context.scene.eso_lod.profile == "unity", bpy.context.scene.eso_lod.profile
    w.picture("step3_unity")
    yield from w.press_button("object.eso_lod_generate")
    clicks += 1
    yield from w.wait_for(lambda: "Suzanne_LOD3" in names(), 60, "the levels")
    yield from w.clear_sidebar()
    w.picture("step4_levels")
    assert visible() == {"Suzanne_LOD0"}, visible()
    yield from w.press_button("object.eso_lod_export")
    clicks += 1
    yield from w.wait_for(lambda: is_open("FILE_BROWSER"), 10, "the file browser")
    yield 1.0
    w.picture("step5_file")
    yield from w.press_button("file.execute", kind="EXECUTE", editor="FILE_BROWSER", x=0.96)
    clicks += 1
    yield from w.wait_for(lambda: bool(list(home.glob("*.fbx"))), 30, "the file")
    yield from w.wait_for(lambda: is_open("VIEW_3D"), 10, "the viewport")
    yield from w.clear_sidebar()
    w.picture("step6_exported")
    FIGURES["clicks from the installed add-on to Unity LODs"] = clicks
    assert clicks <= 6
    yield from in_the_file(next(iter(home.glob("*.fbx"))))


def in_the_file(path: Path) -> Steps:
    """Assert that the exported levels come back in order, each with fewer triangles."""
    before = names()
    bpy.ops.import_scene.fbx(filepath=str(path))
    levels = sorted(names() - before)
    assert [name.split(".")[0] for name in levels] == [f"Suzanne_LOD{n}" for n in range(4)], levels
    counts = [len(bpy.data.objects[name].data.polygons) for name in levels]
    assert counts == sorted(counts, reverse=True), counts
    assert len(set(counts)) == 4, counts
    yield 0.1


def last_tab() -> tuple[float, float]:
    """Find the lowest tab of the sidebar in the picture: ours, since its name was added last."""
    area = w.region("UI")
    strip = w.part(w.capture(), area)[:, -16:-6].max(axis=2).max(axis=1) > 150  # letters
    rows = np.flatnonzero(strip)
    assert len(rows), "the sidebar has no tabs"
    return area.x + area.width - 10, area.y + area.height - rows[-1] - 12


def row_of_menu(before: np.ndarray, after: np.ndarray, row: int, rows: int) -> tuple[float, float]:
    """Find a row of the menu that has opened, from the picture."""
    changed = np.abs(before.astype(int) - after).max(axis=2) > 25
    lines = np.flatnonzero(changed.sum(axis=1) > 60)
    columns = np.flatnonzero(changed.sum(axis=0) > 30)
    top, bottom = lines[0], lines[-1]
    y = top + (bottom - top) * (row + 1.5) / (rows + 1)  # the first is the button itself
    return float(columns[0] + 60), before.shape[0] - float(y)


def scene_stream() -> Steps:
    """Write a stream and read it back."""
    fresh()
    path = Path.home() / "monkey 猿.esopm"
    bpy.ops.export_mesh.esopm(filepath=str(path))
    yield from w.wait_for(path.exists, 60, "the stream")
    assert "base " in last_run().lines
    assert f"whole {path.stat().st_size:,} bytes" in last_run().lines
    count = len(bpy.data.objects["Suzanne"].data.polygons)
    bpy.ops.import_mesh.esopm(filepath=str(path))
    yield 0.5
    yield from w.clear_sidebar()
    w.picture("stream")
    back = bpy.context.object
    assert back.name != "Suzanne", names()
    assert len(back.data.polygons) == count, (len(back.data.polygons), count)


def scene_off_and_on() -> Steps:
    """Switch the add-on off and on: its panel goes along."""
    import addon_utils

    key, milliseconds = "bl_ext.user_default.eso_lod", []
    for _ in range(5):
        addon_utils.disable(key)
        yield 0.3
        assert not hasattr(bpy.types, "VIEW3D_PT_eso_simplify")
        for name in [name for name in sys.modules if name.startswith(key)]:
            del sys.modules[name]  # as after a start
        begun = time.perf_counter()
        addon_utils.enable(key)
        milliseconds.append(1000 * (time.perf_counter() - begun))
        yield 0.3
        assert hasattr(bpy.types, "VIEW3D_PT_eso_simplify")
    FIGURES["milliseconds to enable the add-on"] = {
        "all": [round(each, 1) for each in milliseconds], "median": float(np.median(milliseconds))
    }  # fmt: skip
    fresh()
    bpy.ops.object.eso_simplify(ratio=0.1)
    assert "Suzanne_ESO" in names()


def scene_languages() -> Steps:
    """See the panel in other languages."""
    view = bpy.context.preferences.view
    yield from w.sidebar()
    shown = w.part(w.capture(), w.region("UI"))
    available = [item.identifier for item in view.bl_rna.properties["language"].enum_items_static]
    for language in ("de_DE", "ja_JP"):
        if language not in available:
            continue
        view.language = language
        yield 1.0
        assert np.abs(w.part(w.picture(f"language_{language}"), w.region("UI")).astype(int) - shown).mean() > 0.5
    view.language = "en_US" if "en_US" in available else "DEFAULT"
    yield 0.5


SCENES = [
    scene_panel, scene_simplify, scene_six_clicks, scene_overlays, scene_measure, scene_slider, scene_redo,
    scene_long_work, scene_stream, scene_languages, scene_off_and_on,
]  # fmt: skip


def scenes() -> Iterator[tuple[str, Steps]]:
    """Give those that were asked for, or all; then keep the figures."""
    wanted = [word for word in sys.argv[sys.argv.index("--") + 1 :] if word]
    for function in SCENES:
        name = function.__name__.removeprefix("scene_")
        if not wanted or name in wanted or name == "panel":
            yield name, function()
            (w.OUT / "figures.json").write_text(json.dumps(FIGURES, indent=1), encoding="utf-8")


w.play(scenes())
