# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewer in a real browser, beside three.js with Draco: `python -m benchmarks.viewer [MODELS [NAMES]]`.

The figures go to out/bench/viewer.json. Needs Chromium, Playwright, node and npm; what is
compared with is fetched by npm into the cache folder.
"""

from __future__ import annotations

import base64
import gzip
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from pathlib import Path
from typing import Any

import numpy as np

from eso_addon.progressive.progressive import progressive
from eso_addon.viewer import server as viewer_server
from eso_addon.viewer.client_files import CLIENT

from .meshes import catalogue
from .peers import CACHE

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
         "--disable-dev-shm-usage"]
PACKAGES = ("three@0.187", "draco3d", "esbuild")
BITS = 14
RUNS = 5
_KINDS = {".js": "text/javascript", ".html": "text/html", ".wasm": "application/wasm"}

COVERED = """() => {
  const { view } = document.querySelector('eso-viewer');
  view.renderer.render(view.scene, view.camera);
  const gl = view.renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const out = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, out);
  let text = '';
  for (let at = 0; at < out.length; at += 8192) text += String.fromCharCode(...out.subarray(at, at + 8192));
  return btoa(text);
}"""
DRACO = """<!doctype html><canvas width="640" height="480"></canvas><script type="importmap">
{"imports": {"three": "/three/build/three.module.js"}}</script><script type="module">
import * as THREE from 'three';
import { GLTFLoader } from '/three/examples/jsm/loaders/GLTFLoader.js';
import { DRACOLoader } from '/three/examples/jsm/loaders/DRACOLoader.js';
const renderer = new THREE.WebGLRenderer({ canvas: document.querySelector('canvas'), antialias: true });
const draco = new DRACOLoader().setDecoderPath('/three/examples/jsm/libs/draco/gltf/');
const loader = new GLTFLoader().setDRACOLoader(draco);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, 4 / 3);
scene.add(new THREE.HemisphereLight());
loader.load('/MESH.glb', ({ scene: model }) => {
  model.traverse((node) => node.isMesh && node.geometry.computeVertexNormals());
  scene.add(model);
  const ball = new THREE.Box3().setFromObject(model).getBoundingSphere(new THREE.Sphere());
  camera.position.copy(ball.center).add(new THREE.Vector3(0, 0, 4 * ball.radius));
  camera.far = 9 * ball.radius;
  camera.updateProjectionMatrix();
  renderer.render(scene, camera);
  window.seconds = performance.now() / 1000;
});
</script>"""
WORKERS = {
    "ours.js": """import { readFixed, readHead, crc32 } from '/container.js';
import { base, batch, makeMesh } from '/mesh.js';
onmessage = async ({ data }) => {
  const bytes = new Uint8Array(await (await fetch(data)).arrayBuffer());
  const times = [];
  for (let run = 0; run < 5; run++) {
    const begun = performance.now();
    const head = await readHead(bytes, readFixed(bytes));
    const mesh = makeMesh(head.meshes[0], head.meshes[0]);
    for (const [at, row] of head.rows.entries()) {
      const block = bytes.subarray(row.begin, row.begin + row.length);
      if (crc32(block) !== row.crc) throw new Error('damaged');
      await (at ? batch : base)(mesh, block, row.places, row.faces);
    }
    times.push(performance.now() - begun);
  }
  postMessage(times);
};""",
    "draco.js": """importScripts('/three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js');
onmessage = async ({ data }) => {
  const wasmBinary = await (await fetch('/three/examples/jsm/libs/draco/gltf/draco_decoder.wasm')).arrayBuffer();
  const D = await DracoDecoderModule({ wasmBinary });
  const bytes = new Int8Array(await (await fetch(data)).arrayBuffer());
  const times = [];
  for (let run = 0; run < 5; run++) {
    const begun = performance.now();
    const [decoder, mesh] = [new D.Decoder(), new D.Mesh()];
    decoder.DecodeArrayToMesh(bytes, bytes.length, mesh);
    const [faces, points] = [mesh.num_faces(), mesh.num_points()];
    const pointer = D._malloc(12 * Math.max(faces, points));
    decoder.GetTrianglesUInt32Array(mesh, 12 * faces, pointer);
    new Uint32Array(D.HEAPF32.buffer, pointer, 3 * faces).slice();
    const position = decoder.GetAttribute(mesh, decoder.GetAttributeId(mesh, D.POSITION));
    decoder.GetAttributeDataArrayForAllPoints(mesh, position, D.DT_FLOAT32, 12 * points, pointer);
    new Float32Array(D.HEAPF32.buffer, pointer, 3 * points).slice();
    D._free(pointer);
    D.destroy(mesh);
    D.destroy(decoder);
    times.push(performance.now() - begun);
  }
  postMessage(times);
};"""}


class _Bench(viewer_server._Handler):
    """Also gives out three.js whole, and what is compared with; notes when how much of the mesh goes out."""

    def _answer(self, *, body: bool) -> None:
        server: Any = self.server
        name = self.path.split("?")[0].removeprefix("/")
        data = server.extra.get(name)
        if data is None and name.startswith("three/") and ".." not in name:
            data = (CACHE / "node_modules" / name).read_bytes()
        if data is None:
            return super()._answer(body=body)
        kind = _KINDS.get(Path(name).suffix, "application/octet-stream")
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)
        return None

    def _send_mesh(self, body: bool) -> None:
        server: Any = self.server
        size = server.path.stat().st_size
        asked = self._range(size, self.headers.get("If-Range", ""))
        server.sent.append((time.monotonic(), asked[1] - asked[0] + 1 if asked else size))
        super()._send_mesh(body)


@contextmanager
def _serving(path: Path, extra: dict[str, bytes] | None = None,
             sent: list[tuple[float, int]] | None = None) -> Iterator[str]:
    class Server(viewer_server.MeshServer):
        handler = _Bench

    server: Any = Server(path)
    server.extra = extra or {}
    server.sent = [] if sent is None else sent
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.url
    server.shutdown()
    server.server_close()


def _wait(page: Any, condition: str, seconds: float = 120) -> dict[str, Any]:  # noqa: ANN401
    end = time.monotonic() + seconds
    viewer = "document.querySelector('eso-viewer')"
    asked = f"(() => {{ const s = {viewer}?.stats; return s && ({condition}) ? s : null }})()"
    while (found := page.evaluate(asked)) is None:
        if time.monotonic() > end:
            raise TimeoutError(condition)
        time.sleep(0.02)
    return found


def _picture(page: Any) -> np.ndarray:  # noqa: ANN401
    return np.frombuffer(base64.b64decode(page.evaluate(COVERED)), np.uint8).reshape(480, 640, 4).astype(float)


def first_picture(browser: Any, path: Path) -> dict[str, Any]:  # noqa: ANN401
    """Compare silhouettes of the first picture and the last."""
    with _serving(path) as url:
        page = browser.new_page(viewport={"width": 640, "height": 480})
        page.goto(f"{url}?paused&up=y")
        first = _wait(page, "s.shown > 0")["firstPicture"]
        early = _picture(page)[..., 3] > 127
        page.evaluate("document.querySelector('eso-viewer').pause(false)")
        _wait(page, "s.identical && s.shown === s.faces")
        late = _picture(page)[..., 3] > 127
        page.close()
    return {"bytes": first["bytes"], "iou": float((early & late).sum() / (early | late).sum())}


def tasks(browser: Any, url: str) -> list[float]:  # noqa: ANN401
    """Load a page and return how long each task of its main thread took, in milliseconds."""
    page = browser.new_page(viewport={"width": 640, "height": 480})
    client = page.context.new_cdp_session(page)
    events: list[dict[str, Any]] = []
    client.on("Tracing.dataCollected", lambda part: events.extend(part["value"]))
    done: list[bool] = []
    client.on("Tracing.tracingComplete", lambda _: done.append(True))
    categories = ["toplevel", "disabled-by-default-devtools.timeline"]
    client.send("Tracing.start", {"traceConfig": {"includedCategories": categories}})
    page.goto(url)
    _wait(page, "s.identical && s.shown === s.faces")
    page.wait_for_timeout(300)
    client.send("Tracing.end")
    while not done:
        page.wait_for_timeout(50)
    page.close()
    main = {(one["pid"], one["tid"]) for one in events
            if one["name"] == "thread_name" and one["args"]["name"] == "CrRendererMain"}
    return [one["dur"] / 1000 for one in events
            if one["name"] in ("RunTask", "ThreadControllerImpl::RunTask") and "dur" in one
            and (one["pid"], one["tid"]) in main]


def whole(browser: Any, path: Path, glb: bytes) -> dict[str, Any]:  # noqa: ANN401
    """Time until the whole is there, in turns with three.js and Draco."""
    extra = {"draco.html": DRACO.replace("MESH", "a").encode(), "a.glb": glb}
    ours: list[float] = []
    theirs: list[float] = []
    with _serving(path, extra=extra) as url:
        for _ in range(RUNS):
            page = browser.new_page(viewport={"width": 640, "height": 480})
            page.add_init_script("""for (const name of ['whole', 'level']) document.addEventListener('eso-' + name,
              () => { window.seconds = performance.now() / 1000; });""")
            page.goto(url)
            _wait(page, "s.identical && s.shown === s.faces")
            ours.append(page.evaluate("window.seconds"))
            page.close()
            page = browser.new_page(viewport={"width": 640, "height": 480})
            page.goto(f"{url}draco.html")
            while page.evaluate("window.seconds") is None:
                time.sleep(0.02)
            theirs.append(page.evaluate("window.seconds"))
            page.close()
        lasted = tasks(browser, url)
    return {"seconds": statistics.median(ours), "draco_seconds": statistics.median(theirs), "tasks": len(lasted),
            "task_p95_ms": float(np.percentile(lasted, 95)), "task_longest_ms": max(lasted, default=0.0)}


def decoding(browser: Any, path: Path, drc: bytes) -> dict[str, Any]:  # noqa: ANN401
    """Time decoding in Workers, in turns: the first time in a Worker, and again."""
    extra = {name: text.encode() for name, text in WORKERS.items()} | {"a.drc": drc, "empty.html": b"<html>"}
    run = """([worker, file]) => new Promise((resolve, reject) => {
      const one = new Worker(worker, { type: worker === '/ours.js' ? 'module' : 'classic' });
      one.onerror = reject;
      one.onmessage = ({ data }) => { one.terminate(); resolve(data); };
      one.postMessage(file); })"""
    times: dict[str, list[list[float]]] = {"ours": [], "draco": []}
    with _serving(path, extra=extra) as url:
        page = browser.new_page()
        page.goto(f"{url}empty.html")
        for _ in range(RUNS):
            times["draco"].append(page.evaluate(run, ["/draco.js", "/a.drc"]))
            times["ours"].append(page.evaluate(run, ["/ours.js", "/mesh.esopm"]))
        page.close()
    first = {name: statistics.median(run[0] for run in runs) for name, runs in times.items()}
    warm = {name: statistics.median(one for run in runs for one in run[1:]) for name, runs in times.items()}
    return {"first_ms": first, "warm_ms": warm, "first_ratio": first["ours"] / first["draco"],
            "warm_ratio": warm["ours"] / warm["draco"]}


def throttled(browser: Any, path: Path, rate: float = 100_000.0) -> dict[str, Any]:  # noqa: ANN401
    """Load at so many bytes a second, twice, as reading pictures takes time: first the pace, then the pictures."""
    sent: list[tuple[float, int]] = []
    with _serving(path, sent=sent) as url:  # the client keeps to its budget by itself
        paced = _pace(browser, f"{url}?up=y&budget={rate:.0f}")
        over = max(sum(count for at, count in sent if begin <= at < begin + 1) for begin, _ in sent) / rate
        return {"bytes_over_budget": over, **paced, **_differences(browser, f"{url}?up=y&budget={rate:.0f}")}


def _pace(browser: Any, url: str) -> dict[str, Any]:  # noqa: ANN401
    """Return how often the picture changes."""
    page = browser.new_page(viewport={"width": 640, "height": 480})
    page.add_init_script("""window.levels = [];
        for (const name of ['first', 'level']) document.addEventListener('eso-' + name,
          () => window.levels.push(performance.now()));""")
    page.goto(url)
    _wait(page, "s.identical && s.shown === s.faces")
    waits = np.diff(page.evaluate("window.levels")) / 1000
    page.close()
    return {"pictures": len(waits) + 1, "longest_wait_s": float(waits.max(initial=0.0)),
            "median_wait_s": float(np.median(waits))}


def _differences(browser: Any, url: str) -> dict[str, Any]:  # noqa: ANN401
    """Return how far the pictures of each tenth of the stream are from the last one."""
    page = browser.new_page(viewport={"width": 640, "height": 480})
    page.goto(url)
    pictures: list[tuple[float, np.ndarray]] = []
    while True:
        figures = page.evaluate("document.querySelector('eso-viewer').stats")
        part = figures["received"] / max(figures["bytes"], 1)
        if figures["shown"] and (not pictures or part >= pictures[-1][0] + 0.1):
            pictures.append((part, _picture(page)))
        if figures["identical"] and figures["shown"] == figures["faces"]:
            break
        time.sleep(0.02)
    last = _picture(page)
    page.close()
    off = [(part, float(np.abs(picture - last).mean())) for part, picture in pictures]
    return {"difference": off, "falls": all(a[1] >= b[1] for a, b in zip(off, off[1:], strict=False))}


def script_size() -> dict[str, Any]:
    """Return the bytes of the client's scripts, minified, without three.js: all, packed, and of each file."""
    esbuild = CACHE / "node_modules/.bin/esbuild"

    def minified(*words: str | Path) -> bytes:
        return subprocess.run([esbuild, "--minify", "--format=esm", *words], check=True, capture_output=True).stdout

    text = b"".join(minified(CLIENT / name, "--bundle", "--external:./three.module.js")
                    for name in ("viewer.js", "worker.js"))
    files = sorted(path for path in CLIENT.glob("*.js") if not path.name.startswith("three."))
    return {"minified": len(text), "gzip": len(gzip.compress(text, 9)),
            "files": {path.name: len(minified(path)) for path in files}}


def main() -> int:
    """Measure all and write it down."""
    models = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    chosen = sys.argv[2:] or ["bunny", "turbineblade"]
    chromium = shutil.which("chromium")
    if not (chromium and shutil.which("npm")):
        print("the viewer's benchmark is left out: it needs chromium, node and npm", file=sys.stderr)
        return 0
    from playwright.sync_api import sync_playwright

    if subprocess.run(["npm", "install", "--silent", "--prefix", str(CACHE), *PACKAGES], check=False).returncode:
        print("the viewer's benchmark is left out: npm cannot fetch what it compares with", file=sys.stderr)
        return 0
    meshes = catalogue(models)
    result: dict[str, Any] = {"script": script_size()}
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        for mesh in [name for name in chosen if name in meshes]:
            vertices, faces = meshes[mesh]()
            made = progressive(vertices, faces, meta={"name": mesh})
            made.save(folder / "whole.esopm")
            made.save(folder / "bits.esopm", bits=BITS)
            np.asarray(vertices, "<f4").tofile(folder / "positions")
            np.asarray(faces, "<u4").tofile(folder / "indices")
            subprocess.run(["node", str(Path(__file__).with_name("viewer.mjs")), str(CACHE / "node_modules/draco3d"),
                            folder / "positions", folder / "indices", str(BITS), folder / "draco"], check=True)
            result[mesh] = {
                "bytes": (folder / "whole.esopm").stat().st_size,
                "first_picture": first_picture(browser, folder / "whole.esopm"),
                "decoding": decoding(browser, folder / "bits.esopm", (folder / "draco.drc").read_bytes()),
                "whole": whole(browser, folder / "whole.esopm", (folder / "draco.glb").read_bytes()),
                "throttled": throttled(browser, folder / "whole.esopm")}
            print(mesh, json.dumps(result[mesh], indent=1))
        browser.close()
    out = Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    (out / "viewer.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(result["script"], f"{out / 'viewer.json'} written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
