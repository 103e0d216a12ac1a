# SPDX-License-Identifier: GPL-3.0-or-later
"""A hand and an eye in Blender's window: simulated mouse and keys, buttons found by what they do, pictures."""

import os
import subprocess
import time
import traceback
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

OUT = Path(os.environ["GUI_OUT"])
Steps = Generator[float, None, None]

# A picture is taken of the whole screen: Blender's own screenshot is black under software OpenGL.
_CAPTURE = ["import", "-silent", "-window", "root"]


def window() -> bpy.types.Window:
    """Give the main window."""
    return bpy.context.window_manager.windows[0]


def view() -> bpy.types.Area:
    """Give the 3D viewport."""
    return next(area for area in window().screen.areas if area.type == "VIEW_3D")


def region(kind: str) -> bpy.types.Region:
    """Give a region of the viewport."""
    return next(region for region in view().regions if region.type == kind)


def work_done() -> tuple[float, float]:
    """Give the seconds that all cores have been busy, and those for this process; zeros where the system hides them."""
    try:
        with open("/proc/stat", encoding="ascii") as file:
            user, nice, system, _, _, *rest = map(int, file.readline().split()[1:9])
    except OSError:
        return 0.0, 0.0
    return (user + nice + system + sum(rest)) / os.sysconf("SC_CLK_TCK"), sum(os.times()[:2])


def clear_sidebar() -> Steps:
    """Scroll the sidebar up and take the mouse out of it."""
    area = region("UI")
    for _ in range(10):
        press("WHEELUPMOUSE", area.x + 60, area.y + area.height // 2)
    yield 0.2
    place = region("WINDOW")
    move(place.x + 120, place.y + place.height - 200)
    yield from still()


def still(most: float = 5) -> Steps:
    """Wait until the window has drawn all that it has to draw: two pictures are the same."""
    end, before = time.monotonic() + most, None
    while time.monotonic() < end:
        yield 0.4
        after = capture()
        if before is not None and np.array_equal(before, after):
            return
        before = after


def look_at_object() -> None:
    """Fill the viewport with what is selected."""
    with bpy.context.temp_override(window=window(), area=view(), region=region("WINDOW")):
        bpy.ops.view3d.view_selected()


def sidebar(category: str = "ESO") -> Steps:
    """Open the sidebar at a tab."""
    view().spaces.active.show_region_ui = True
    yield 0.6
    region("UI").active_panel_category = category  # only once it has been drawn
    view().tag_redraw()
    yield 0.6


def move(x: float, y: float) -> None:
    """Put the mouse somewhere, in the window's coordinates from below left."""
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def press(kind: str, x: float, y: float, value: str = "PRESS", **held: bool) -> None:
    """Press or release a mouse button or a key at a place."""
    window().event_simulate(type=kind, value=value, x=int(x), y=int(y), **held)


def click(x: float, y: float) -> Steps:
    """Click where something is drawn."""
    move(x, y - 3)
    yield 0.1
    move(x, y)
    yield 0.25
    press("LEFTMOUSE", x, y)
    yield 0.1
    press("LEFTMOUSE", x, y, "RELEASE")
    yield 0.3


def key(kind: str, **held: bool) -> Steps:
    """Press a key with the mouse in the middle of the viewport."""
    area = region("WINDOW")
    x, y = area.x + area.width // 3, area.y + area.height // 2
    move(x, y)
    yield 0.1
    press(kind, x, y, **held)
    yield 0.05
    press(kind, x, y, "RELEASE")
    yield 0.3


def drag(start: tuple[float, float], end: tuple[float, float], moves: int = 12, rest: float = 0.1) -> Steps:
    """Drag from one place to another."""
    move(*start)
    yield 0.3
    press("LEFTMOUSE", *start)
    yield 0.1
    for step in range(1, moves + 1):
        part = step / moves
        move(start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part)
        yield rest
    press("LEFTMOUSE", *end, "RELEASE")
    yield 0.4


def capture() -> np.ndarray:
    """Give the screen as (height, width, 3) uint8."""
    data = subprocess.run([*_CAPTURE, "-depth", "8", "ppm:-"], check=True, capture_output=True).stdout
    _, size, _, pixels = data.split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)


def picture(name: str) -> np.ndarray:
    """Keep a picture of the screen and give it."""
    subprocess.run([*_CAPTURE, str(OUT / f"{name}.png")], check=True)
    return capture()


def part(image: np.ndarray, area: bpy.types.Region | bpy.types.Area) -> np.ndarray:
    """Cut a region out of a picture."""
    height = image.shape[0]
    return image[height - area.y - area.height : height - area.y, area.x : area.x + area.width]


def under_mouse(kind: str = "UI", editor: str = "VIEW_3D") -> str:
    """Say what the button under the mouse does: `bpy.ops...` or the path of its property."""
    manager = bpy.context.window_manager
    area = next(area for area in window().screen.areas if area.type == editor)
    place = next(region for region in area.regions if region.type == kind)
    with bpy.context.temp_override(window=window(), area=area, region=place):
        for name in ("copy_python_command_button", "copy_data_path_button"):
            manager.clipboard = ""
            try:
                getattr(bpy.ops.ui, name)()
            except RuntimeError:
                continue
            if manager.clipboard:
                return manager.clipboard
    return ""


def find(
    what: str, found: list[tuple[int, int]], *, x: float = 0.6, kind: str = "UI", editor: str = "VIEW_3D"
) -> Steps:
    """Look for a button from the top down, by what it does; appends where it is to `found`.

    Where it is not in sight the region is scrolled: up first, then down.
    """
    area = next(area for area in window().screen.areas if area.type == editor)
    place = next(region for region in area.regions if region.type == kind)
    across, middle = place.x + int((place.width - 20) * x), place.y + place.height // 2
    for wheel in ("", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELDOWNMOUSE"):
        for _ in range(8 if wheel else 0):
            move(across, middle)
            press(wheel, across, middle)
            yield 0.05
        for y in range(place.y + place.height - 10, place.y + 3, -9):
            move(across, y)
            yield 0.06
            if what in under_mouse(kind, editor):
                found.append((across, y - 3))
                return
    raise AssertionError(f"no button for {what} in {editor} {kind}")


def press_button(what: str, **where: Any) -> Steps:  # noqa: ANN401 - as of `find`
    """Find a button and click it."""
    found: list[tuple[int, int]] = []
    yield from find(what, found, **where)
    yield from click(*found[0])


def wait_for(condition: Callable[[], bool], seconds: float, what: str) -> Steps:
    """Wait until something is so."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds:g} s for {what}"
        yield 0.1


def play(scenes: Iterator[tuple[str, Steps]]) -> None:
    """Play scenes one after the other from a timer; say how each ended, and quit."""
    failed: list[str] = []

    def run() -> Steps:
        for name, steps in scenes:
            started = time.monotonic()
            try:
                yield from steps
            except Exception:  # the next scene may still work
                traceback.print_exc()
                failed.append(name)
                picture(f"failed_{name}")
                for _ in range(3):  # whatever is open
                    press("ESC", 300, 300)
                    yield 0.3
            print(f"{'FAILED' if name in failed else 'passed'}  {name}  {time.monotonic() - started:.1f} s", flush=True)
        (OUT / "result.txt").write_text("\n".join(failed) or "ok", encoding="utf-8")
        os._exit(1 if failed else 0)  # no question about unsaved changes

    steps = run()
    bpy.app.timers.register(lambda: next(steps, None), first_interval=1.5)
