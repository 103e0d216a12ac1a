# SPDX-License-Identifier: GPL-3.0-or-later
"""What a visitor gets: a first picture, the whole, a level, a message where something is wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eso_addon.progressive.progressive import load_progressive, progressive
from eso_addon.progressive.scene import Scene
from eso_addon.viewer.client_files import CLIENT, FILES
from eso_addon.viewer.page import write_page

from ..progressive.meshes import grid
from .sites import Site, stats, until, words

Start = Callable[..., Site]
Page = Any


def test_it_ends_identical_to_the_original(page: Page, site: Start, torus: Path) -> None:
    page.goto(site().url)
    figures = until(page, "s.identical && s.shown === s.faces")
    assert figures["received"] == figures["bytes"] == torus.stat().st_size
    assert figures["faces"] == 5000
    assert figures["pixels"] == 0
    assert words(page, ".state") == "identical to the original"
    assert words(page, "b") == page.title().split(" – ")[0] == "torus"
    assert "5\u202f000" in words(page, ".triangles")


def test_the_first_picture_needs_few_bytes(page: Page, site: Start) -> None:
    server = site()
    page.goto(server.url)
    figures = until(page, "s.identical")
    assert figures["firstPicture"]["bytes"] <= 12_000
    assert server.requests[0] == "bytes=0-8191"
    asked = [tuple(int(word) for word in one.removeprefix("bytes=").split("-")) for one in server.requests]
    for (_, end), (begin, _) in zip(asked, asked[1:]):
        assert begin == end + 1  # nothing twice


# how much of the picture is covered, and how bright that is, mean and deviation
PICTURE = """() => {
  const { view } = document.querySelector('eso-viewer');
  view.renderer.render(view.scene, view.camera);
  const gl = view.renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const out = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, out);
  let [count, sum, squares] = [0, 0, 0];
  for (let at = 0; at < out.length; at += 4) {
    if (out[at + 3] < 128) continue;
    count += 1;
    sum += out[at];
    squares += out[at] ** 2;
  }
  return [count / (w * h), sum / count, Math.sqrt(squares / count - (sum / count) ** 2)];
}"""


def test_the_picture_is_of_the_mesh(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?theme=light&colours=plain")
    until(page, "s.identical && s.shown === s.faces")
    covered, brightness, deviation = page.evaluate(PICTURE)
    assert 0.04 < covered < 0.9
    assert 60 < brightness < 240
    assert deviation > 5  # it is lit


def test_levels_back_and_forth(page: Page, site: Start, torus: Path) -> None:
    base = load_progressive(torus).base_faces
    page.goto(site().url)
    until(page, "s.identical && s.shown === s.faces")
    page.locator("eso-viewer >> css=.base").click()
    assert until(page, "s.shown < s.faces")["shown"] == base
    page.locator("eso-viewer >> css=.level").fill("0.5")
    shown = until(page, f"s.shown > {base} && s.shown < s.faces")["shown"]
    assert shown == pytest.approx((base * 5000) ** 0.5, rel=0.02)
    assert "level of" in words(page, ".state")
    page.locator("eso-viewer >> css=.whole").click()
    until(page, "s.shown === s.faces")
    assert words(page, ".state") == "identical to the original"


def test_a_level_asks_for_no_more_than_it_needs(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?level=0.5")
    figures = until(page, "s.shown > 0 && s.waiting")
    assert figures["received"] < 0.7 * figures["bytes"]
    assert figures["shown"] < figures["faces"]
    page.evaluate("document.querySelector('eso-viewer').level(1)")
    assert until(page, "s.identical")["received"] == figures["bytes"]


def test_pause_and_go_on(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?budget=2000")
    until(page, "s.shown > 0")
    page.locator("eso-viewer >> css=.play").click()
    page.wait_for_timeout(300)
    held = stats(page)["received"]
    assert words(page, ".state") == "paused"
    page.wait_for_timeout(500)
    assert stats(page)["received"] == held
    page.locator("eso-viewer >> css=.play").click()
    page.locator("eso-viewer >> css=.more").click()
    page.locator("eso-viewer >> css=[name=budget]").select_option("0")
    figures = until(page, "s.identical")
    assert figures["received"] == figures["bytes"]


# a clock that goes on by a step at each reading, and what was asked for within half a second of real time
BUDGET_AT_STEP = """async (step) => {
  const { makeStream } = await import('./stream.js');
  let time = 0;
  performance.now = () => (time += step);
  const asked = [];
  const line = { ranges: true, read: async function* (...span) { asked.push(span); await new Promise(() => {}); } };
  makeStream(line, { budget: 2000, level: 1, cap: Infinity }, () => {}, () => {});
  await new Promise((resolve) => setTimeout(resolve, 500));
  return asked.length;
}"""


@pytest.mark.parametrize("parts", [1, 3, 4])
def test_a_budget_that_is_full_at_the_second_look_is_not_waited_for(page: Page, site: Start, parts: int) -> None:
    page.goto(site().url)
    assert page.evaluate(BUDGET_AT_STEP, 512 / parts) > 0


def test_an_error_on_screen_is_enough(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?error=16")
    figures = until(page, "s.waiting && s.pixels > 0")
    assert figures["received"] < figures["bytes"]
    assert 0 < figures["pixels"] <= 16
    assert words(page, ".state") == "as fine as the view needs"
    page.locator("eso-viewer >> css=canvas").hover()
    for _ in range(12):
        page.mouse.wheel(0, -200)
    until(page, f"s.received > {figures['received']}")


def test_a_budget_is_kept(page: Page, site: Start, torus: Path) -> None:
    server = site()
    page.goto(f"{server.url}?budget=20000")
    assert until(page, "s.identical")["received"] == torus.stat().st_size
    asked = [[int(word) for word in str(one).removeprefix("bytes=").split("-")] for one in server.requests]
    assert len(asked) > 5  # bit by bit
    for (_, end), begun in zip(asked[1:], server.times[1:], strict=True):
        assert end - asked[0][1] <= 1.1 * 20000 * (begun - server.times[0]) + 1024


def test_frame_time_lowers_the_level(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?frame=1")
    until(page, "s.identical && s.shown < s.faces")
    page.evaluate("document.querySelector('eso-viewer').set('frame', 0)")
    until(page, "s.shown === s.faces")


def test_wire_and_settings(page: Page, site: Start) -> None:
    page.goto(site().url)
    until(page, "s.identical && s.shown === s.faces")
    page.locator("eso-viewer >> css=.wire").click()
    until(page, "document.querySelector('eso-viewer').view.meshes[0].wire?.drawRange.count === 30000")
    page.locator("eso-viewer >> css=[name=wire]").press("Enter")  # sends no form
    page.locator("eso-viewer >> css=[name=wire]").press("Space")
    assert page.evaluate("document.querySelector('eso-viewer').view.root.children[0].children[0].visible") is False
    assert "?" not in page.url
    page.locator("eso-viewer >> css=.more").click()
    for name, value in {"colours": "uv", "shading": "flat", "up": "y"}.items():
        page.locator(f"eso-viewer >> css=[name={name}]").select_option(value)
    page.wait_for_timeout(200)


SEAT = "(({ theta, phi, radius }) => [theta, phi, radius])(document.querySelector('eso-viewer').view.orbit.seat)"


def test_keys_and_mouse_move_the_camera(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?paused")
    until(page, "s.pixels > 0")
    home = page.evaluate(SEAT)
    page.locator("eso-viewer >> css=canvas").focus()
    for key, changed in {"ArrowRight": 0, "ArrowLeft": 0, "ArrowUp": 1, "ArrowDown": 1, "+": 2, "-": 2}.items():
        before = page.evaluate(SEAT)
        page.keyboard.press(key)
        after = page.evaluate(SEAT)
        assert [at for at in range(3) if after[at] != before[at]] == [changed]
    for _ in range(99):
        page.keyboard.press("ArrowDown")
    assert page.evaluate(SEAT)[1] > 0  # not over the top
    page.keyboard.press("Home")
    assert page.evaluate(SEAT) == home
    target = "document.querySelector('eso-viewer').view.orbit.target.toArray()"
    center = page.evaluate(target)
    for button in ("left", "right"):
        page.mouse.move(300, 200)
        page.mouse.down(button=button)
        page.mouse.move(340, 220)
        page.mouse.up(button=button)
        assert (page.evaluate(target) != center) == (button == "right")
    page.mouse.move(390, 250)  # no button is down
    turned = page.evaluate(SEAT)
    assert turned != home
    page.mouse.wheel(0, 100)
    until(page, f"{SEAT}[2] > {turned[2]}")
    page.mouse.dblclick(300, 200)
    assert page.evaluate(SEAT) == home
    assert page.evaluate(target) == center


def test_touch(browser: Any, site: Start) -> None:  # noqa: ANN401
    context = browser.new_context(viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(site().url)
    until(page, "s.shown > 0")
    orbit = "document.querySelector('eso-viewer').view.orbit"
    azimuth, distance = page.evaluate(f"[{orbit}.seat.theta, {orbit}.seat.radius]")
    touch = context.new_cdp_session(page)
    for kind, points in (("touchStart", [(100, 200)]), ("touchMove", [(160, 210)]), ("touchEnd", [])):
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]})
    turned = page.evaluate(f"{orbit}.seat.theta")
    assert turned != azimuth
    near, wide = [(150, 200), (200, 250)], [(100, 150), (250, 300)]
    for kind, points in (("touchStart", near), ("touchMove", wide), ("touchEnd", [])):
        touch.send("Input.dispatchTouchEvent",
                   {"type": kind, "touchPoints": [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]})
    assert page.evaluate(f"{orbit}.seat.radius") < 0.7 * distance
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()


def test_light_and_dark(browser: Any, site: Start) -> None:  # noqa: ANN401
    inks = []
    for scheme in ("light", "dark"):
        context = browser.new_context(color_scheme=scheme)
        page = context.new_page()
        page.goto(site().url)
        inks.append(page.locator("eso-viewer >> css=.state").evaluate("(node) => getComputedStyle(node).color"))
        context.close()
    assert inks[0] != inks[1]


def scene_file(path: Path) -> Path:
    """Write two meshes, three objects, two materials, UVs and colours."""
    rng = np.random.default_rng(3)
    meshes = []
    for number in range(2):
        points, faces = grid(16, 16, rng, closed=True)
        attributes = {
            "corner": {"UVMap": points[faces][..., :2],
                       "Col": rng.integers(0, 255, (*faces.shape, 4)).astype(np.uint8)},
            "face": {"material_index": (np.arange(len(faces)) % 2).astype(np.int32)}}
        meta = {"name": f"ring {number}", "materials": [0, 1], "uv": "UVMap", "types": {"Col": "BYTE_COLOR"}}
        meshes.append(progressive(points, faces, attributes=attributes if number else None, meta=meta))
    def matrix(x: float) -> list[float]:
        return [1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    objects = [{"name": "near", "mesh": 0, "matrix": matrix(0)}, {"name": "same", "mesh": 0, "matrix": matrix(9)},
               {"name": "far", "mesh": 1, "matrix": matrix(400)}]
    materials = [{"name": "red", "color": [0.8, 0.1, 0.1, 1]}, {"name": "glass", "color": [0.1, 0.1, 0.8, 0.5]}]
    Scene(meshes, {"objects": objects, "materials": materials}).save(path)
    return path


def test_objects_and_materials(page: Page, site: Start, tmp_path: Path) -> None:
    page.goto(site(scene_file(tmp_path / "scene.esopm")).url)
    until(page, "s.identical && s.shown === s.faces")
    nodes = page.evaluate("""document.querySelector('eso-viewer').view.root.children.map((node) => ({
      name: node.name, x: node.matrix.elements[12], groups: node.geometry.groups.length,
      colours: node.material.map((one) => one.color.getHex()), through: node.material.map((one) => one.transparent),
      has: Object.keys(node.geometry.attributes) }))""")
    assert [node["name"] for node in nodes] == ["near", "same", "far"]
    assert [node["x"] for node in nodes] == [0, 9, 400]
    assert nodes[2]["groups"] == 2
    assert nodes[2]["through"] == [False, True]
    assert set(nodes[2]["has"]) == {"position", "normal", "uv", "color"}
    assert nodes[0]["colours"][0] != 0xB9BFC9


def test_objects_out_of_sight_wait(page: Page, site: Start, tmp_path: Path) -> None:
    page.goto(f"{site(scene_file(tmp_path / 'scene.esopm')).url}?paused")
    far = until(page, "s.pixels > 0")["pixels"]  # the worker knows what the camera sees
    page.evaluate("""(() => { const viewer = document.querySelector('eso-viewer'); const { orbit } = viewer.view;
      orbit.target.set(4, 0, 0); orbit.seat.set(30, Math.PI / 2, 0); orbit.aim(); })()""")
    until(page, f"s.pixels > {2 * far}")
    page.evaluate("document.querySelector('eso-viewer').pause(false)")
    waiting = until(page, "s.waiting")
    assert waiting["received"] < waiting["bytes"]
    page.evaluate("document.querySelector('eso-viewer').view.orbit.home()")
    until(page, "s.identical")


def test_a_page_that_holds_the_mesh(page: Page, torus: Path, tmp_path: Path) -> None:
    write_page(torus, tmp_path / "torus.html")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "torus.html").as_uri())
    until(page, "s.identical && s.shown === s.faces")
    assert {url.split(":")[0] for url in asked} <= {"file", "blob", "data"}
    assert sum(url.startswith("file") for url in asked) == 1


def test_a_held_page_asks_for_no_more_than_it_needs(page: Page, torus: Path, tmp_path: Path) -> None:
    write_page(torus, tmp_path / "torus.html")
    page.goto(f"{(tmp_path / 'torus.html').as_uri()}?level=0.5")
    figures = until(page, "s.shown > 0 && s.waiting")
    assert figures["received"] < 0.7 * figures["bytes"]


def test_one_tag_from_another_server(page: Page, torus: Path) -> None:
    def client(route: Any) -> None:  # noqa: ANN401
        name = route.request.url.rpartition("/")[2]
        route.fulfill(body=(CLIENT / name).read_bytes(), content_type=FILES[name],
                      headers={"Access-Control-Allow-Origin": "*"})

    tag = '<script type="module" src="https://client.test/viewer.js" data-src="torus.esopm"></script>'
    page.route("https://client.test/*", client)
    page.route("https://site.test/", lambda route: route.fulfill(body=tag, content_type="text/html"))
    page.route("https://site.test/torus.esopm", lambda route: route.fulfill(body=torus.read_bytes()))
    page.goto("https://site.test/")
    until(page, "s.identical && s.shown === s.faces")
    look = page.locator("eso-viewer >> css=form").evaluate("(node) => getComputedStyle(node).position")
    assert look == "absolute"  # its style is there too


def test_dump_gives_what_is_there(page: Page, site: Start, torus: Path) -> None:
    page.goto(site().url)
    until(page, "s.identical")
    dump = "document.querySelector('eso-viewer').dump().then(([mesh]) => [...mesh.faces])"
    assert page.evaluate(dump) == load_progressive(torus).restore().faces.ravel().tolist()


def test_one_tag_on_a_page(page: Page, site: Start) -> None:
    url = site().url
    tag = '<script type="module" src="viewer.js" data-src="mesh.esopm" data-up="y" data-name="A ring"></script>'
    text = f"<p>before</p>{tag}"
    page.route("**/host.html", lambda route: route.fulfill(body=text, content_type="text/html"))
    page.goto(f"{url}host.html")
    until(page, "s.identical")
    assert page.locator("eso-viewer").bounding_box()["height"] == 480
    assert words(page, "b") == "A ring"
