# SPDX-License-Identifier: GPL-3.0-or-later
"""A server whose line can be made to fail in every way, and what a page says."""

import threading
import time
from http import HTTPStatus
from pathlib import Path
from typing import Any

from eso_addon.viewer import server as viewer_server
from eso_addon.viewer.server import MeshServer


class Line(viewer_server._Handler):
    """Does to the mesh's bytes what the test says."""

    server: "Site"

    def _send_mesh(self, body: bool) -> None:
        site = self.server
        site.requests.append(self.headers.get("Range"))
        site.times.append(time.monotonic())
        if site.status:
            return self._refuse(HTTPStatus(site.status), "as the test wants it")
        if not site.ranges:
            del self.headers["Range"]
        if site.rate or site.stop_after is not None:
            return self._send_slowly()
        return super()._send_mesh(body)

    def _send_slowly(self) -> None:
        site = self.server
        data = site.path.read_bytes()
        asked = self._range(len(data), "")
        first, last = asked or (0, len(data) - 1)
        headers = {"Content-Length": str(last - first + 1), "Content-Type": "application/octet-stream"}
        if asked:
            headers["Content-Range"] = f"bytes {first}-{last}/{len(data)}"
        self._head(HTTPStatus.PARTIAL_CONTENT if asked else HTTPStatus.OK, headers)
        step = max(int(site.rate / 50), 1) if site.rate else 4096
        for at in range(first, last + 1, step):
            part = data[at : min(at + step, last + 1)]
            if site.stop_after is not None and site.sent + len(part) > site.stop_after:
                self.wfile.write(part[: max(site.stop_after - site.sent, 0)])
                self.close_connection = True
                self.connection.close()
                return
            self.wfile.write(part)
            site.sent += len(part)
            if site.rate:
                time.sleep(step / site.rate)


class Site(MeshServer):
    """A server on a thread of its own."""

    handler = Line

    def __init__(self, path: Path, port: int = 0) -> None:
        self.requests: list[str | None] = []
        self.times: list[float] = []
        self.ranges, self.status, self.rate, self.sent = True, 0, 0.0, 0
        self.stop_after: int | None = None
        super().__init__(path, port)
        self.thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        self.thread.start()

    def close(self) -> None:
        """Stop listening."""
        self.shutdown()
        self.server_close()
        self.thread.join()


def stats(page: Any) -> dict[str, Any]:  # noqa: ANN401
    """Give what the viewer's bar says, as numbers."""
    return page.evaluate("document.querySelector('eso-viewer').stats")


def until(page: Any, condition: str, seconds: float = 40) -> dict[str, Any]:  # noqa: ANN401
    """Wait until something holds of the viewer's figures, `s`; give them."""
    asked = f"(() => {{ const s = document.querySelector('eso-viewer')?.stats; return s && ({condition}) }})()"
    end = time.monotonic() + seconds
    while not page.evaluate(asked):
        assert time.monotonic() < end, (condition, stats(page))
        time.sleep(0.03)
    return stats(page)


def words(page: Any, selector: str) -> str:  # noqa: ANN401
    """Give the text of something in the viewer, once it is written: that happens every 80 ms at most."""
    read = "async (node) => { await new Promise((done) => setTimeout(done, 100)); return node.innerText; }"
    return page.locator(f"eso-viewer >> css={selector}").evaluate(read)
