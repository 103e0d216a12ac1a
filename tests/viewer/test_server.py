# SPDX-License-Identifier: GPL-3.0-or-later
"""The server gives out one file and the client, in ranges, and nothing else."""

import http.client
import os
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from eso_addon.cli import main
from eso_addon.viewer.client_files import CLIENT, FILES
from eso_addon.viewer.server import MeshServer

from .sites import Site

Start = Callable[..., Site]


@pytest.fixture
def stream(tmp_path: Path) -> Path:
    path = tmp_path / "some.esopm"
    path.write_bytes(b"\x89ESOPM\r\n" + bytes(range(256)) * 9)
    return path


@pytest.fixture
def ask(site: Start, stream: Path) -> Iterator[Callable[..., tuple[int, dict[str, str], bytes]]]:
    server = site(stream)
    line = http.client.HTTPConnection(*server.server_address[:2], timeout=10)

    def get(target: str = "/mesh.esopm", method: str = "GET",
            **headers: str) -> tuple[int, dict[str, str], bytes]:
        line.request(method, target, headers={name.replace("_", "-"): value for name, value in headers.items()})
        answer = line.getresponse()
        return answer.status, dict(answer.headers), answer.read()

    yield get
    line.close()


@pytest.mark.parametrize(("asked", "first", "last"), [
    ("bytes=0-0", 0, 0), ("bytes=5-9", 5, 9), ("bytes=100-", 100, 2311), ("bytes=-7", 2305, 2311),
    ("bytes=0-99999", 0, 2311), ("bytes=-99999", 0, 2311)])
def test_ranges(ask: Callable, stream: Path, asked: str, first: int, last: int) -> None:
    status, headers, body = ask(Range=asked)
    assert status == 206
    assert headers["Content-Range"] == f"bytes {first}-{last}/2312"
    assert int(headers["Content-Length"]) == len(body)
    assert body == stream.read_bytes()[first : last + 1]


@pytest.mark.parametrize("asked", ["bytes=2312-", "bytes=99999-100000", "bytes=-0"])
def test_ranges_beyond_the_end(ask: Callable, asked: str) -> None:
    status, headers, _ = ask(Range=asked)
    assert status == 416
    assert headers["Content-Range"] == "bytes */2312"


@pytest.mark.parametrize("asked", ["bytes=9-5", "bytes=-", "bytes=0-1,5-6", "lines=1-2", "bytes=a-b", "", "bytes=٣-"])
def test_what_is_no_range_gives_the_whole(ask: Callable, stream: Path, asked: str) -> None:
    status, headers, body = ask(Range=asked.encode("utf-8").decode("latin-1"))
    assert status == 200
    assert headers["Accept-Ranges"] == "bytes"
    assert body == stream.read_bytes()


def test_ranges_only_of_the_same_file(ask: Callable, stream: Path) -> None:
    tag = ask(method="HEAD")[1]["ETag"]
    assert ask(Range="bytes=1-2", If_Range=tag)[0] == 206
    os.utime(stream, ns=(1, 1))
    assert ask(Range="bytes=1-2", If_Range=tag)[0] == 200


def test_headers(ask: Callable) -> None:
    kinds = {"": "text/html", "viewer.js": "text/javascript", "mesh.esopm": "application/octet-stream"}
    for name, kind in kinds.items():
        status, headers, body = ask(f"/{name}?level=0.5")
        assert status == 200
        assert headers["Content-Type"].split(";")[0] == kind
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        status, headers, nothing = ask(f"/{name}", "HEAD")
        assert (status, nothing, int(headers["Content-Length"])) == (200, b"", len(body))


@pytest.mark.parametrize("target", [
    "/../server.py", "/..%2fserver.py", "/%2e%2e/server.py", "//etc/passwd", "/./viewer.js", "/client/viewer.js",
    "/server.py", "/some.esopm", "/three", "/index.html/", "/%00", "\\..\\server.py", "/mesh.esopm/",
    "/viewer.js/../../server.py"])
def test_nothing_else(ask: Callable, target: str) -> None:
    status, _, body = ask(target)
    assert status == 404
    assert b"def " not in body


def test_other_methods_are_refused(ask: Callable) -> None:
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert ask(method=method)[0] in (405, 501)


def test_other_names_of_this_computer_are_refused(ask: Callable) -> None:
    assert ask(Host="evil.example:80")[0] == 403
    assert ask(Host="localhost:1")[0] == 200


def test_loopback_unless_told(stream: Path) -> None:
    with MeshServer(stream) as server:
        assert server.server_address[0] == "127.0.0.1"
        assert server.server_address[1] > 0
    with MeshServer(stream, host="0.0.0.0") as server:
        assert server.server_address[0] == "0.0.0.0"
        assert "0.0.0.0" not in server.url


def test_a_file_that_goes_away(ask: Callable, stream: Path) -> None:
    stream.unlink()
    assert ask()[0] == 404


def test_the_worker_comes_as_one_and_its_modules_apart(ask: Callable) -> None:
    status, headers, body = ask("/worker.js")
    assert status == 200
    assert int(headers["Content-Length"]) == len(body)
    assert b"\nimport " not in body
    assert b"modules['stream.js'] =" in body
    assert ask("/stream.js")[2].startswith(b"//")


def test_all_files_of_the_client_are_known() -> None:
    assert {path.name for path in CLIENT.iterdir()} == set(FILES)


def test_serve_says_where_and_stops(stream: Path, root: Path) -> None:
    command = [sys.executable, "-m", "eso_addon", "serve", str(stream), "--port", "0"]
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        url = next(word for word in line.split() if word.startswith("http://127.0.0.1:"))
        with urllib.request.urlopen(f"{url}mesh.esopm", timeout=10) as answer:
            assert answer.read() == stream.read_bytes()
        process.send_signal(2)
        assert process.wait(10) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""


def test_serve_tells_what_is_wrong(stream: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other.esopm"
    other.write_bytes(b"solid")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for words in ([other], [tmp_path / "none.esopm"], [stream, "--port", port], [stream, "--host", "256.1.1.1"]):
            assert main(["serve", *map(str, words)]) == 1
            error = capsys.readouterr().err
            assert error.startswith("eso_lod: ")
            assert error.count("\n") == 1
    for words in ([stream, "--port", "65536"], [stream, "--port", "x"], ["mesh.ply"], []):
        assert main(["serve", *map(str, words)]) == 2
