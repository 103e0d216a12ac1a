# SPDX-License-Identifier: GPL-3.0-or-later
"""What docs/format.md says is what the files are: a reader written from it alone restores the same meshes."""

from typing import Any

import numpy as np
import pytest

from eso_addon.progressive.progressive import progressive
from eso_addon.progressive.scene import Scene, scene_from_bytes

from . import short_reader
from .meshes import grid, spoil


def attributes_for(points: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    seam = rng.random(faces.shape) < 0.1
    return {
        "vertex": {"weight": rng.random((len(points), 2)).astype(np.float32), "big": np.arange(len(points)) << 35},
        "corner": {"uv": np.where(seam[..., None], 0.5, points[faces][..., :2]).astype(np.float32)},
        "face": {"material_index": (np.arange(len(faces)) // 20).astype(np.int16)},
        "side": {"seam": rng.random(faces.shape) < 0.2},
        "edge": {"seam": np.array([True])},
    }


@pytest.mark.parametrize("kind", ["plain", "soup", "holes", "fins", "flipped"])
@pytest.mark.parametrize("bits", [None, 11])
def test_a_second_reader_finds_the_same(kind: str, bits: int | None) -> None:
    rng = np.random.default_rng(len(kind))
    meshes = []
    for number in range(2):
        points, faces = spoil(*grid(5, 6, rng, closed=number == 0), rng, kind)
        points = (points + 0.123).astype(np.float32)
        options: dict[str, Any] = {}
        if number:
            options = {"attributes": attributes_for(points, faces, rng), "edges": [[0, len(points) - 1]]}
        meshes.append(progressive(points, faces, base_faces=4, **options))
    data = Scene(meshes).to_bytes(bits=bits)
    levels = scene_from_bytes(data).levels()
    for level, found in zip(levels, short_reader.read(data), strict=True):
        vertices, corners, edges, named = found.result()
        assert np.array_equal(np.array(vertices, np.float32), level.vertices)
        assert np.array_equal(corners, level.faces)
        assert np.array_equal(np.array(edges).reshape(-1, 2), level.edges)
        for (domain, name), values in named.items():
            assert values == np.ascontiguousarray(level.attributes[domain][name]).tobytes(), (domain, name)
