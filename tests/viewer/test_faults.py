# SPDX-License-Identifier: GPL-3.0-or-later
"""What may go wrong on the way: a clear message, what came stays, loading goes on where it stopped."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from eso_addon.progressive import container

from .sites import Site, stats, until, words

Start = Callable[..., Site]
Page = Any


def spans(path: Path) -> list[tuple[int, int]]:
    """Give begin and end of each block."""
    data = path.read_bytes()
    lengths = container.read(data, partial=False).table["length"].tolist()
    begin = len(data) - sum(lengths)
    found = []
    for length in lengths:
        found.append((begin, begin + length))
        begin += length
    return found


def test_no_ranges(page: Page, site: Start) -> None:
    server = site(ranges=False)
    page.goto(server.url)
    figures = until(page, "s.identical")
    assert len(server.requests) == 1
    assert figures["received"] == figures["bytes"]


def test_server_gone_and_back(page: Page, site: Start, torus: Path) -> None:
    server = site(stop_after=12_000)
    page.goto(server.url)
    until(page, "s.message")
    figures = stats(page)
    assert "trying again" in words(page, ".message")
    assert figures["shown"] > 0
    server.close()
    page.wait_for_timeout(300)
    assert stats(page)["shown"] >= figures["shown"]
    again = Site(torus, server.server_address[1])
    try:
        page.evaluate("document.querySelector('eso-viewer').again()")
        whole = until(page, "s.identical")
        assert whole["received"] == whole["bytes"]  # nothing came twice
        assert whole["message"] == ""
        assert not page.locator("eso-viewer >> css=.message").is_visible()
    finally:
        again.close()


def test_no_ranges_and_gone_and_back(page: Page, site: Start) -> None:
    server = site(stop_after=12_000, ranges=False)
    page.goto(server.url)
    until(page, "s.message")
    server.stop_after = None
    until(page, "s.identical")


@pytest.mark.parametrize(("status", "text"), [(404, "no such file"), (403, "refuses"), (500, "refuses")])
def test_status(page: Page, site: Start, status: int, text: str) -> None:
    server = site(status=status)
    page.goto(server.url)
    until(page, "s.message")
    assert text in words(page, ".message")
    assert str(status) in words(page, ".message")
    server.status = 0
    if status < 500:  # of its own accord it tries again only where that may help
        page.locator("eso-viewer >> css=.again").click()
    until(page, "s.identical")


@pytest.mark.parametrize("ranges", [True, False])
@pytest.mark.parametrize("part", [0.02, 0.5, 0.99])
def test_cut_short(page: Page, site: Start, torus: Path, tmp_path: Path, part: float, ranges: bool) -> None:
    data = torus.read_bytes()
    (tmp_path / "a.esopm").write_bytes(data[: int(part * len(data))])
    page.goto(site(tmp_path / "a.esopm", ranges=ranges).url)
    figures = until(page, "s.message")
    assert "cut short" in words(page, ".message")
    assert (figures["shown"] > 0) == (part > 0.1)
    assert words(page, ".state") == "stopped"


def test_damaged(page: Page, site: Start, torus: Path, tmp_path: Path) -> None:
    data = bytearray(torus.read_bytes())
    begin, end = spans(torus)[-3]
    data[(begin + end) // 2] ^= 1
    (tmp_path / "a.esopm").write_bytes(data)
    server = site(tmp_path / "a.esopm")
    page.goto(server.url)
    figures = until(page, "s.message && s.shown > 0")
    assert "damaged at block" in words(page, ".message")
    until(page, "s.shown > 100")
    (tmp_path / "a.esopm").write_bytes(torus.read_bytes())  # mended: but it is another file now
    page.locator("eso-viewer >> css=.again").click()
    until(page, "s.message !== ''")
    assert figures["identical"] is False


def test_damaged_on_the_way_only(page: Page, site: Start, torus: Path) -> None:
    """What a bad line did to a block is mended by asking for it once more."""
    server = site(torus)
    begin = spans(torus)[-1][0]
    spoilt: list[bool] = []
    send = server.handler._send_mesh

    class Spoiler(server.handler):  # type: ignore[name-defined, misc]
        def _send_mesh(self, body: bool) -> None:
            del self.headers["If-Range"]
            asked = self._range(10**9, "") or (0, 0)
            if asked[0] <= begin and asked[0] > 0 and not spoilt:
                spoilt.append(True)
                data = bytearray(torus.read_bytes())
                data[begin + 30] ^= 1
                part = data[asked[0]:]
                self._head(206, {"Content-Range": f"bytes {asked[0]}-{len(data) - 1}/{len(data)}",  # type: ignore[arg-type]
                                 "Content-Length": str(len(part))})
                self.wfile.write(part)
                return
            send(self, body)

    server.RequestHandlerClass = Spoiler
    page.goto(server.url)
    assert until(page, "s.identical")["message"] == ""
    assert spoilt


@pytest.mark.parametrize(("at", "value", "text"), [
    (8, 2, "version 2.0"), (10, 1, "version 1.1"), (30, 255, "header of the file is damaged"), (0, 0, "not an .esopm")])
def test_other_files(page: Page, site: Start, torus: Path, tmp_path: Path, at: int, value: int, text: str) -> None:
    data = bytearray(torus.read_bytes())
    server = site(torus)
    data[at] = value
    (tmp_path / "a.esopm").write_bytes(data)
    server.path = tmp_path / "a.esopm"
    page.goto(server.url)
    until(page, "s.message")
    assert text in words(page, ".message")


def test_changed_in_the_middle(page: Page, site: Start, torus: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.esopm"
    path.write_bytes(torus.read_bytes())
    server = site(path)
    page.goto(f"{server.url}?level=0.2")
    until(page, "s.waiting")
    path.write_bytes(torus.read_bytes() + b" ")
    page.evaluate("document.querySelector('eso-viewer').level(1)")
    until(page, "s.message")
    assert "has changed" in words(page, ".message")
    assert stats(page)["shown"] > 0


def test_no_webgl(page: Page, site: Start) -> None:
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(site().url)
    page.wait_for_selector("eso-viewer")
    page.locator("eso-viewer >> css=.message").wait_for()
    assert "WebGL" in words(page, ".message")


def test_little_memory(page: Page, site: Start) -> None:
    page.goto(f"{site().url}?memory=0.2")
    figures = until(page, "s.shown > 0 && s.waiting")
    assert "memory of this device" in words(page, ".message")
    assert figures["shown"] < figures["faces"]


def test_no_server_at_all(page: Page, site: Start) -> None:
    server = site()
    page.goto(f"{server.url}?level=0.1")
    until(page, "s.waiting")
    server.stop_after = 0  # the line that is still open breaks at once
    server.close()
    page.evaluate("document.querySelector('eso-viewer').level(1)")
    until(page, "s.message.includes('does not answer')")
    assert stats(page)["shown"] > 0
