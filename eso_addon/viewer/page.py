# SPDX-License-Identifier: GPL-3.0-or-later
"""One HTML file that holds a stream and the client, for sending to someone."""

from __future__ import annotations

import base64
import html
import json
import os
import re
import zlib
from pathlib import Path

from ..files.atomic import atomic_output
from .client_files import CLIENT

_THREE = ("three.core.js", "three.module.js")
_IMPORT = re.compile(r"^import (?:\{([^}]*)\} from )?'\./([\w.]+)';\n", flags=re.MULTILINE)
_LATER = re.compile(r"import\('\./([\w.]+)'\)")
_TEXT = re.compile(r"await \(await fetch\(new URL\('\./([\w.]+)', import\.meta\.url\)\)\)\.text\(\)")
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function|class|const) (\w+))", flags=re.MULTILINE)
_MAGIC = b"\x89ESOPM\r\n"

_PAGE = """<!doctype html>
<!-- SPDX-License-Identifier: GPL-3.0-or-later; three.js: see its licence at the end of this page -->
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>
html, body {{ height: 100%; margin: 0; background: Canvas; }}
eso-viewer {{ height: 100vh; height: 100dvh; border-radius: 0; }}
</style>
<body>
<eso-viewer from-url name="{title}"></eso-viewer>
<noscript>This page shows a mesh with JavaScript: switch it on.</noscript>
<script type="application/octet-stream" id="mesh">{mesh}</script>
<script type="text/plain" id="three.core.js">{core}</script>
<script type="text/plain" id="three.module.js">{module}</script>
<script type="text/plain" id="worker">{worker}</script>
<script type="module">
const text = (id) => document.getElementById(id).textContent;
const url = (source) => URL.createObjectURL(new Blob([source], {{ type: 'text/javascript' }}));
const unpack = async (id) => {{
  const bytes = Uint8Array.from(atob(text(id)), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'))).text();
}};
const core = url(await unpack('three.core.js'));
const three = await import(url((await unpack('three.module.js')).replaceAll('./three.core.js', core)));
globalThis.ESO_WORKER = url(`const MESH = '${{text('mesh')}}';\n${{text('worker')}}`);
{client}</script>
<!--
{licence}-->
"""

# before the worker's modules: what they ask a server for, in ranges, is in the page
_HELD = """const mesh = Uint8Array.from(atob(MESH), (letter) => letter.charCodeAt(0));
globalThis.fetch = async (_, { headers }) => {
  const [begin, last] = headers.Range.match(/\\d+/g).map(Number);
  const span = { 'Content-Range': `bytes ${begin}-${last}/${mesh.length}` };
  return new Response(mesh.subarray(begin, last + 1), { status: 206, headers: span });
};
"""


def write_page(esopm_path: str | os.PathLike[str], html_path: str | os.PathLike[str], *,
               title: str | None = None) -> int:
    """Write a single self-contained HTML file with the stream and all that shows it inside.

    Parameters
    ----------
    esopm_path
        The stream.
    html_path
        The page; appears whole or not at all.
    title : str, optional
        The page's title; the stream's name without one.

    Returns
    -------
    int
        Bytes written.

    Raises
    ------
    ValueError
        The file is no stream.
    OSError
        A file cannot be read or written.
    """
    source = Path(esopm_path)
    data = source.read_bytes()
    if not data.startswith(_MAGIC):
        raise ValueError(f"{source.name} is not an .esopm file: make one with the word stream")
    core, module = (_packed((CLIENT / name).read_bytes()) for name in _THREE)
    page = _PAGE.format(
        title=html.escape(title if title is not None else source.stem),
        mesh=base64.b64encode(data).decode(), core=core, module=module,
        worker=_HELD + bundle("worker.js"), client=bundle("viewer.js"),
        licence=(CLIENT / "three.LICENSE").read_text(encoding="utf-8"),
    )
    with atomic_output(html_path) as draft:
        draft.write_text(page, encoding="utf-8")
    return len(page.encode())


def _packed(data: bytes) -> str:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return base64.b64encode(packer.compress(data) + packer.flush()).decode()


def bundle(entry: str) -> str:
    """Return a module of the client and all that it imports as one script; three.js is expected as `three`."""
    parts: dict[str, str] = {}
    _collect(entry, parts)
    start = "const modules = { 'three.module.js': typeof three === 'undefined' ? {} : three };\n"
    return (start + "".join(parts.values())).replace("</script", "<\\/script")


def _collect(name: str, parts: dict[str, str]) -> None:
    if name in parts or name in _THREE:
        return
    text = (CLIENT / name).read_text(encoding="utf-8")
    for needed in [name for _, name in _IMPORT.findall(text)] + _LATER.findall(text):
        _collect(needed, parts)
    names = ", ".join(_EXPORT.findall(text))
    body = _IMPORT.sub(lambda found: f"const {{{found[1]}}} = modules['{found[2]}'];\n" if found[1] else "", text)
    body = _TEXT.sub(lambda found: json.dumps((CLIENT / found[1]).read_text(encoding="utf-8")), body)
    body = _EXPORT.sub("", _LATER.sub(r"modules['\1']", body))
    parts[name] = f"modules['{name}'] = (() => {{\n{body}return {{ {names} }};\n}})();\n"
