# SPDX-License-Identifier: GPL-3.0-or-later
"""A server for one stream and the web client, and for nothing else: byte ranges, loopback only unless told."""

from __future__ import annotations

import hashlib
import os
import re
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BufferedIOBase
from pathlib import Path
from urllib.parse import urlsplit

from .client_files import CLIENT, FILES
from .page import bundle

MESH = "mesh.esopm"
_MAGIC = b"\x89ESOPM\r\n"
_RANGE = re.compile(r"bytes=(\d*)-(\d*)$")
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; worker-src 'self'; connect-src 'self'; "
                               "style-src 'self' 'unsafe-inline'; img-src 'self' data:; base-uri 'none'",
}


class _Handler(BaseHTTPRequestHandler):
    server: MeshServer
    server_version = "eso-lod"
    sys_version = ""
    protocol_version = "HTTP/1.1"
    timeout = 60  # seconds that a silent visitor keeps a thread
    disable_nagle_algorithm = True  # else a body waits 40 ms for the visitor to acknowledge its headers

    def do_GET(self) -> None:
        """Answer a request for a file."""
        self._answer(body=True)

    def do_HEAD(self) -> None:
        """Answer a request for a file's headers."""
        self._answer(body=False)

    def log_message(self, *_args: object) -> None:
        """Keep quiet: the command line's output is for its user."""

    def _answer(self, *, body: bool) -> None:
        name = urlsplit(self.path).path.removeprefix("/") or "index.html"
        if not self._is_for_us():
            return self._refuse(HTTPStatus.FORBIDDEN, "this server answers to its own name only")
        if name == MESH:
            return self._send_mesh(body)
        if name not in FILES:  # names are looked up, never joined to a path
            return self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here")
        # the worker's modules as one: the first byte of the mesh waits for all of them
        data = bundle(name).encode() if name == "worker.js" else (CLIENT / name).read_bytes()
        self._head(HTTPStatus.OK, {"Content-Type": FILES[name], "Content-Length": str(len(data))})
        if body:
            self.wfile.write(data)
        return None

    def _is_for_us(self) -> bool:
        """Tell whether a request on loopback names loopback, lest a foreign page reads the file by its own name."""
        if self.server.server_address[0] not in _LOOPBACK:
            return True
        return (urlsplit(f"//{self.headers.get('Host', '')}").hostname or "") in _LOOPBACK

    def _send_mesh(self, body: bool) -> None:
        try:
            file = self.server.path.open("rb")
        except OSError:
            return self._refuse(HTTPStatus.NOT_FOUND, "the file is gone")
        with file:
            status = os.fstat(file.fileno())
            size = status.st_size
            tag = hashlib.sha256(f"{size} {status.st_mtime_ns} {status.st_ino}".encode()).hexdigest()[:16]
            headers = {"Content-Type": "application/octet-stream", "Accept-Ranges": "bytes", "ETag": f'"{tag}"'}
            first, last = 0, size - 1
            asked = self._range(size, headers["ETag"])
            if asked == ():
                headers["Content-Range"] = f"bytes */{size}"
                return self._refuse(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, "the file is shorter", headers)
            if asked:
                first, last = asked
                headers["Content-Range"] = f"bytes {first}-{last}/{size}"
            self._head(HTTPStatus.PARTIAL_CONTENT if asked else HTTPStatus.OK,
                       {**headers, "Content-Length": str(last - first + 1)})
            if body:
                file.seek(first)
                _copy(file, self.wfile, last - first + 1)
        return None

    def _range(self, size: int, tag: str) -> tuple[int, int] | tuple[()] | None:
        """Return first and last byte asked for, () where there is none, None for the whole file (RFC 9110, 14)."""
        found = _RANGE.match(self.headers.get("Range", "").strip())
        if not found or found.groups() == ("", "") or self.headers.get("If-Range", tag) != tag:
            return None
        begin, end = found.groups()
        if not begin:
            return (max(size - int(end), 0), size - 1) if int(end) and size else ()
        last = min(int(end), size - 1) if end else size - 1
        if end and int(end) < int(begin):
            return None
        return (int(begin), last) if int(begin) < size else ()

    def _refuse(self, status: HTTPStatus, reason: str, headers: dict[str, str] | None = None) -> None:
        data = f"{status.value} {status.phrase}: {reason}\n".encode()
        self._head(status, {**(headers or {}), "Content-Type": "text/plain; charset=utf-8",
                            "Content-Length": str(len(data))})
        if self.command != "HEAD":
            self.wfile.write(data)

    def _head(self, status: HTTPStatus, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Cache-Control": "no-cache", **headers}.items():
            self.send_header(name, value)
        self.end_headers()


class MeshServer(ThreadingHTTPServer):
    """Serves one .esopm file under /mesh.esopm and the client under /.

    Parameters
    ----------
    path : Path
        The file; opened anew for every request, so that it may be written again meanwhile.
    port : int
        0 for any that is free.
    host : str
        The address to listen at.

    Raises
    ------
    ValueError
        The file is no stream, or the port cannot be had.
    OSError
        The file cannot be read.
    """

    daemon_threads = True
    handler = _Handler

    def __init__(self, path: Path, port: int = 0, host: str = "127.0.0.1") -> None:
        with path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                raise ValueError(f"{path.name} is not an .esopm file: make one with the word stream")
        self.path = path
        try:
            super().__init__((host, port), self.handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise ValueError(f"cannot listen at {host}:{port}: {reason}; choose another --port, or none") from None

    @property
    def url(self) -> str:
        """The address of the page."""
        host = str(self.server_address[0])
        return f"http://{'localhost' if host in ('0.0.0.0', '::') else host}:{self.server_address[1]}/"

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing where a visitor went away in the middle."""


def _copy(source: BufferedIOBase, target: BufferedIOBase, length: int) -> None:
    """Copy so many bytes."""
    whole, rest = divmod(length, 1 << 16)
    for size in [1 << 16] * whole + [rest]:
        target.write(source.read(size))
