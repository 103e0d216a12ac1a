# SPDX-License-Identifier: GPL-3.0-or-later
"""A damaged stream gives one clear error, or its good prefix; never anything else."""

import json
import subprocess
import sys
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest

from eso_addon.progressive import container, stream
from eso_addon.progressive.errors import StreamError
from eso_addon.progressive.progressive import Progressive, from_bytes, progressive
from eso_addon.progressive.scene import scene_from_bytes

from .meshes import grid, spoil

COUNTS = ("places", "faces", "extra", "edges", "vertices", "wedges", "lanes")


def streams() -> list[bytes]:
    rng = np.random.default_rng(0)
    made = []
    for number in range(4):
        points, faces = grid(5 + number, 6, rng, closed=number % 2 == 0)
        if number == 3:
            points, faces = spoil(points, faces, rng, "soup")
        attributes = None
        if number % 2:
            attributes = {"corner": {"uv": rng.random((len(faces), 3, 2)).astype(np.float32)},
                          "face": {"material": np.arange(len(faces)) // 9}}
        whole = progressive(points, faces, attributes=attributes, base_faces=4)
        made.append(whole.to_bytes(keep_order=number > 1))
    return made


STREAMS = streams()


def use(data: bytes, *, partial: bool) -> Progressive | None:
    """Read and use a stream; None where it is refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            mesh = from_bytes(data, partial=partial)
        except StreamError:
            return None
        mesh.restore()
        mesh.at(faces=mesh.base_faces + 3)
    return mesh


@pytest.mark.parametrize("data", STREAMS[:2], ids=["plain", "attributes"])
def test_cut_at_any_byte(data: bytes) -> None:
    for size in range(0, len(data), 3):
        assert use(data[:size], partial=False) is None
    for size in range(0, len(data), 29):
        mesh = use(data[:size], partial=True)
        assert mesh is None or mesh.damage


def test_any_flipped_bit_is_noticed() -> None:
    data = STREAMS[1]
    rng = np.random.default_rng(1)
    for place in rng.integers(0, len(data), 60):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(0, 8))
        assert use(bytes(damaged), partial=False) is None
        mesh = use(bytes(damaged), partial=True)
        assert mesh is None or mesh.damage


def test_other_versions_and_files_are_refused() -> None:
    data = bytearray(STREAMS[0])
    data[8] = 2
    with pytest.raises(StreamError, match="version 2"):
        from_bytes(bytes(data))
    with pytest.raises(StreamError, match=r"not an \.esopm"):
        from_bytes(b"ply\nformat ascii 1.0\n" * 9)


def test_unknown_needs_are_refused_and_unknown_options_skipped() -> None:
    parts = container.read(STREAMS[0], partial=False)
    parts.optional["sparkle", 0] = b"123"
    assert from_bytes(container.write(parts)).face_count
    parts.header["meshes"][0]["needs"] = ["holograms"]
    with pytest.raises(StreamError, match="holograms"):
        from_bytes(container.write(parts))


def tampered(data: bytes, rng: np.random.Generator) -> bytes:
    """Change contents and counts, and put the checksums right again."""
    parts = container.read(data, partial=False)
    blocks, table = [bytearray(b) for b in parts.blocks], parts.table.copy()
    header = json.loads(json.dumps(parts.header))
    first = header["meshes"][0]
    for kind in rng.integers(0, 10, rng.integers(1, 4)):
        block = blocks[rng.integers(0, len(blocks))]
        entry = first if rng.random() < 0.8 else header
        name = str(rng.choice(list(entry)))
        if kind < 7 and len(block):
            block[rng.integers(0, len(block))] = rng.integers(0, 256)
            if kind == 0:
                del block[rng.integers(0, len(block) + 1) :]
        elif kind == 7:
            name = COUNTS[rng.integers(0, len(COUNTS))]
            known = parts.header["meshes"][0][name]
            first[name] = int(rng.choice([0, 1, known + 1, 2**20, 2**31 - 1]))
        elif kind == 8:
            row = rng.integers(0, len(table))
            table["places"][row:] = int(rng.choice([0, 1000, 10**6, 2**31]))
            first["places"] = int(table["places"][-1]) % 2**31
        else:
            entry[name] = [None, [], "x", -1, 1.5, {}, [[1, 2, 3]], True, [0, 1e308, 0, 0, 0, 3]][rng.integers(0, 9)]
    table["length"] = [len(block) for block in blocks]
    table["checksum"] = [zlib.crc32(bytes(block)) for block in blocks]
    return container.write(container.Container(header, table, [bytes(b) for b in blocks], parts.optional))


def test_tampered_contents_with_right_checksums() -> None:
    rng = np.random.default_rng(2)
    refused = 0
    for number in range(200):
        refused += use(tampered(STREAMS[number % 4], rng), partial=bool(number % 2)) is None
    assert refused > 100


def test_what_once_failed() -> None:
    parts = container.read(STREAMS[0], partial=False)
    for name, value in (("extra", True), ("places", True), ("grid", [0, 1e308, 0, 0, 0, 3]), ("lanes", 0)):
        header = {**parts.header, "meshes": [{**parts.header["meshes"][0], name: value}]}
        assert use(container.write(container.Container(header, parts.table, parts.blocks)), partial=False) is None
    # counts that no float holds, and types that numpy reads and nobody writes
    far = {"names": ["a"], "formats": ["f4"], "offsets": [10**30]}
    for kind, shape in (("<f4", [float("inf")]), ("<f4", [10**400]), ("<f4", [-1]), ("(", []), (far, []), (">f4", [])):
        attributes = [["vertex", "g", kind, shape]]
        header = {**parts.header, "meshes": [{**parts.header["meshes"][0], "attributes": attributes}]}
        assert use(container.write(container.Container(header, parts.table, parts.blocks)), partial=False) is None
    # columns without rows, and more of them than a file of this size fills
    for domain, shape in (("edge", 10**6), ("vertex", 10**4), ("edge", 10**9)):
        attributes = [[domain, f"a{number}", "<f4", [shape]] for number in range(300)]
        header = {**parts.header, "meshes": [{**parts.header["meshes"][0], "attributes": attributes}]}
        assert use(container.write(container.Container(header, parts.table, parts.blocks)), partial=False) is None
    header = {**parts.header, "meshes": [{**parts.header["meshes"][0], "needs": ["9" * 5000]}]}
    with pytest.raises(StreamError, match=r"^.{,200}$"):
        from_bytes(container.write(container.Container(header, parts.table, parts.blocks)))
    for number in (1e308, 10**400, float("nan"), float("-inf"), "1", None):
        objects = [{"name": "a", "mesh": 0, "matrix": [number] * 16}]
        header = {**parts.header, "meta": {"objects": objects}}
        with pytest.raises(StreamError):
            scene_from_bytes(container.write(container.Container(header, parts.table, parts.blocks)))
    # a signalling NaN is a position like any other
    points, faces = grid(4, 4, np.random.default_rng(0))
    points.view(np.uint32)[0, 0] = 0x7F800001
    assert use(progressive(points, faces).to_bytes(), partial=False) is not None


def test_what_memory_does_not_hold_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(stream, "decode_mesh", fail)
    with pytest.raises(StreamError, match="more than memory"):
        from_bytes(STREAMS[0])


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.esopm"
    path.write_bytes(b"old")
    points, faces = grid(4, 4, np.random.default_rng(0))
    mesh = progressive(points, faces)

    def fail(self: Path, data: bytes) -> int:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(OSError, match="disk full"):
        mesh.save(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_killed_save_leaves_the_old_file(tmp_path: Path, root: Path) -> None:
    path = tmp_path / "a.esopm"
    path.write_bytes(b"old")
    killed = """
import os, sys
from pathlib import Path
from eso_addon.progressive.progressive import progressive

def half(self, data):
    with self.open("wb") as file:
        file.write(data[: len(data) // 2])
        file.flush()
        os._exit(7)  # nothing is tidied up, as when a process is killed

Path.write_bytes = half
progressive([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).save(sys.argv[1])
"""
    done = subprocess.run([sys.executable, "-c", killed, str(path)], cwd=root, check=False)
    assert done.returncode == 7
    assert path.read_bytes() == b"old"
