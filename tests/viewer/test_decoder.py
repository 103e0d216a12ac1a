# SPDX-License-Identifier: GPL-3.0-or-later
"""The page decodes what Python decodes, byte for byte, after every batch."""

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eso_addon.core.mesh import Ints
from eso_addon.progressive import container
from eso_addon.progressive.progressive import Level, progressive
from eso_addon.progressive.scene import Scene, scene_from_bytes

from ..progressive.meshes import KINDS, Arrays, grid, spoil
from .sites import Site

Decode = Callable[[bytes], dict[str, Any]]
# decodes the file block by block; gives, for each block, hashes of its mesh as it then is
DECODE = """async () => {
  const [container, { base, batch, makeMesh }, { finest, digest }] = await Promise.all(
    ['container', 'mesh', 'finest'].map((name) => import(`/${name}.js`)));
  const bytes = new Uint8Array(await (await fetch('/mesh.esopm')).arrayBuffer());
  const head = await container.readHead(bytes, container.readFixed(bytes));
  const meshes = head.meshes.map((entry) => makeMesh(entry, entry));
  const hex = async (array) => Array.from(new Uint8Array(await crypto.subtle.digest('SHA-256', array)),
    (byte) => byte.toString(16).padStart(2, '0')).join('');
  const rows = [];
  for (const [at, row] of head.rows.entries()) {
    const block = bytes.subarray(row.begin, row.begin + row.length);
    if (container.crc32(block) !== row.crc) throw new Error(`block ${at}`);
    const mesh = meshes[row.mesh];
    await (at < meshes.length ? base : batch)(mesh, block, row.places, row.faces);
    const level = finest(mesh);
    const arrays = [level.vertices, level.faces, level.edges, ...level.attributes.map((each) => each.bytes)];
    rows.push({ mesh: row.mesh, end: row.begin + row.length, hashes: await Promise.all(arrays.map(hex)) });
  }
  const same = [];
  for (const mesh of meshes) same.push((await digest(mesh)) === mesh.head.hash);
  const { sha256 } = await import('/hash.js');
  return { rows, same, own: await sha256(bytes, null) };
}"""


def hashes(level: Level) -> list[str]:
    """Hash a level's arrays in the file's order."""
    arrays: list[Any] = [level.vertices.astype("<f4"), level.faces.astype("<i4"), level.edges.astype("<i4")]
    for domain in ("vertex", "corner", "face", "side", "edge"):
        arrays += level.attributes.get(domain, {}).values()
    return [hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest() for array in arrays]


@pytest.fixture(scope="module")
def decode(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Decode]:  # noqa: ANN401 - untyped
    """Give a function that decodes bytes in the browser."""
    path = tmp_path_factory.mktemp("decoder") / "a.esopm"
    path.write_bytes(container.MAGIC)
    context = browser.new_context()
    page = context.new_page()
    site = Site(path)
    page.goto(f"{site.url}three.LICENSE")

    def run(data: bytes) -> dict[str, Any]:
        path.write_bytes(data)
        return page.evaluate(DECODE)

    yield run
    context.close()
    site.close()


def check(found: dict[str, Any], data: bytes) -> None:
    """Compare every step with Python's."""
    whole = scene_from_bytes(data).meshes
    table = container.read(data, partial=False).table
    for row, places in zip(found["rows"], table["places"].tolist(), strict=True):
        assert row["hashes"] == hashes(whole[row["mesh"]]._level(places)), places
    for row in found["rows"][len(whole) - 1 :: max(len(table) // 3, 1)]:
        part = scene_from_bytes(data[: row["end"]], partial=True)
        assert row["hashes"] == hashes(part.meshes[row["mesh"]].restore())
    assert all(found["same"])
    assert found["own"] == hashlib.sha256(data).hexdigest()


def attributes(points: Ints, faces: Ints, rng: np.random.Generator) -> dict[str, Any]:
    """Make attributes of every width and domain."""
    seam = rng.random(faces.shape) < 0.1
    return {
        "vertex": {"group": rng.random((len(points), 2)).astype(np.float32), "far": rng.random(len(points)),
                   "byte": rng.integers(-9, 9, len(points)).astype(np.int8)},
        "corner": {"uv": np.where(seam[..., None], -0.5, points[faces][..., :2]).astype(np.float32),
                   "colour": rng.integers(0, 255, (*faces.shape, 4)).astype(np.uint8)},
        "face": {"material_index": (np.arange(len(faces)) // 20).astype(np.int16), "id": np.arange(len(faces))},
        "side": {"diagonal": rng.random(faces.shape) < 0.3, "pair": rng.random((*faces.shape, 2)).astype(np.float32)},
    }


def make(kind: str, seed: int, *, rich: bool) -> Arrays:
    """Make a mesh of a kind, in random order."""
    rng = np.random.default_rng(seed)
    points, faces = grid(11, 9, rng, closed=bool(seed % 2))
    points, faces = spoil(points, faces, rng, kind)
    order = rng.permutation(len(points))
    points, faces = points[order], np.argsort(order)[faces][rng.permutation(len(faces))]
    mesh: Arrays = {"vertices": points, "faces": faces}
    if rich:
        mesh["attributes"] = attributes(points, faces, rng)
        mesh["edges"] = rng.integers(0, len(points), (3, 2))
        mesh["attributes"]["edge"] = {"mark": np.arange(3, dtype=np.int32)}
    return mesh


@pytest.mark.parametrize("rich", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_batch(decode: Decode, kind: str, rich: bool) -> None:
    mesh = make(kind, len(kind), rich=rich)
    data = progressive(**mesh, base_faces=4).to_bytes()
    check(decode(data), data)


@pytest.mark.parametrize("scale", [1.0, 1e-20, 1e20])
def test_every_grid(decode: Decode, scale: float) -> None:
    points, faces = grid(12, 12, np.random.default_rng(1), closed=True)
    turned = (points.astype(np.float64) @ np.linalg.qr(np.arange(9).reshape(3, 3) ** 1.3)[0] * scale).astype(np.float32)
    for data in (progressive(turned, faces).to_bytes(), progressive(np.round(points, 3), faces).to_bytes(),
                 progressive(turned, faces).to_bytes(bits=11)):
        check(decode(data), data)


def test_places_with_many_corners(decode: Decode) -> None:
    count = 300  # two cones: escapes of lengths and starts
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.sin(9 * angle) / 9], axis=1)
    points = np.concatenate([[[0, 0, 1.0]], [[0, 0, -1.0]], ring]).astype(np.float32)
    around = np.arange(count) + 2
    after = np.roll(around, -1)
    faces = np.concatenate([np.stack([np.zeros(count, int), around, after], axis=1),
                            np.stack([np.ones(count, int), after, around], axis=1)])
    data = progressive(points, faces, base_faces=4).to_bytes()
    check(decode(data), data)


def test_several_meshes(decode: Decode) -> None:
    meshes = [progressive(**make(kind, seed, rich=rich), base_faces=4)
              for seed, (kind, rich) in enumerate([("plain", False), ("parts", True), ("soup", False)])]
    data = Scene(meshes).to_bytes()
    found = decode(data)
    check(found, data)
    assert {row["mesh"] for row in found["rows"]} == {0, 1, 2}


def test_only_whole_files_are_the_original(decode: Decode, torus: Path) -> None:
    data = bytearray(torus.read_bytes())
    table = container.read(bytes(data), partial=False).table
    assert decode(bytes(data))["same"] == [True]
    data[-int(table["length"][-1]) // 2] ^= 4
    with pytest.raises(Exception, match=f"block {len(table) - 1}"):
        decode(bytes(data))
