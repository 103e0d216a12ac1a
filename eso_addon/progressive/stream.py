# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes to the bytes of a stream, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.mesh import Ints
from . import container
from .container import Container
from .errors import StreamError
from .mesh_codec import EncodedMesh, decode_mesh
from .patches import Patches


def file_order(meshes: list[EncodedMesh], scales: list[float]) -> tuple[Ints, Ints]:
    """Return the mesh and the block of each row of a file's table: bases first, then batches by what they mend.

    Parameters
    ----------
    meshes : list of EncodedMesh
    scales : list of float
        How large each mesh's unit is in the scene.
    """
    mesh = np.concatenate([np.full(len(each.places), index) for index, each in enumerate(meshes)])
    block = np.concatenate([np.arange(len(each.places)) for each in meshes])
    # a batch mends the error before it, which never grows along a mesh
    before = np.concatenate([np.append(np.inf, np.minimum.accumulate(each.errors[:-1]) * scale)
                             for each, scale in zip(meshes, scales, strict=True)])
    order = np.lexsort((block, mesh, -before, block > 0))
    return mesh[order], block[order]


def encode(meshes: list[EncodedMesh], meta: dict[str, Any], scales: list[float]) -> bytes:
    """Return the bytes of a file; `scales` as in `file_order`."""
    mesh, block = file_order(meshes, scales)
    rows = list(zip(mesh.tolist(), block.tolist(), strict=True))
    blocks = [meshes[index].blocks[number] for index, number in rows]
    places, faces, errors = (np.array([getattr(meshes[index], name)[number] for index, number in rows])
                             for name in ("places", "faces", "errors"))
    table = container.make_table(blocks, places, faces, errors, mesh)
    optional = {(name, index): data for index, each in enumerate(meshes) for name, data in each.optional.items()}
    header = {"meshes": [each.header for each in meshes], "meta": meta}
    return container.write(Container(header, table, blocks, optional))


def decode(data: bytes, *, partial: bool = False) -> tuple[list[tuple[EncodedMesh, Patches]], dict[str, Any], str]:
    """Return the meshes of a file, its header's `meta`, and what was wrong with it (only with `partial`)."""
    parts = container.read(data, partial=partial)
    table = parts.table
    meshes = []
    for index, header in enumerate(parts.header["meshes"]):
        own = np.flatnonzero(table["mesh"] == index)
        blocks = [parts.blocks[row] for row in own if row < len(parts.blocks)]
        optional = {name: block for (name, mesh), block in parts.optional.items() if mesh == index}
        mesh = EncodedMesh(header, blocks, table["places"][own].astype(np.int64), table["faces"][own].astype(np.int64),
                           table["error"][own].astype(np.float64), optional)
        try:
            meshes.append((mesh, decode_mesh(mesh)))
        except MemoryError:
            raise StreamError("the stream says that it holds more than memory does: fetch the file again") from None
    return meshes, parts.header.get("meta", {}), parts.damage
