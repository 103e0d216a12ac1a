# SPDX-License-Identifier: GPL-3.0-or-later
"""Several progressive meshes in one file, with the objects that show them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.mesh import MeshError
from .container import is_transform
from .progressive import Level, Progressive, read_part, write_bytes
from .stream import decode, encode, file_order


@dataclass
class Scene:
    """What an .esopm file holds.

    Attributes
    ----------
    meshes : list of Progressive
    meta : dict
        `objects`: a list of {name, mesh, matrix}, the place of each object's mesh in `meshes` and its transform, 16
        numbers row by row; `materials`; anything else that JSON holds.
    damage : str
        What was wrong with a file that was loaded in part; empty where nothing was.
    """

    meshes: list[Progressive]
    meta: dict[str, Any] = field(default_factory=dict)
    damage: str = ""

    @property
    def face_count(self) -> int:
        """Triangles of the finest level that is there, of all meshes, each once."""
        return sum(mesh.face_count for mesh in self.meshes)

    def scales(self) -> list[float]:
        """Return how large the unit of each mesh is in the scene: of its largest object; 1 where it has none."""
        found: dict[int, float] = {}
        for entry in self.meta.get("objects", []):
            matrix = np.array(entry["matrix"], np.float64).reshape(4, 4)[:3, :3]
            scale = float(np.linalg.norm(matrix, axis=0).max())
            found[entry["mesh"]] = max(found.get(entry["mesh"], 0.0), scale)
        return [found.get(index) or 1.0 for index in range(len(self.meshes))]

    def levels(self, *, faces: int | None = None, error: float | None = None) -> list[Level]:
        """Return a level of each mesh: with at most so many triangles together, or within an error in the scene.

        The finest ones where neither is given: the originals.
        """
        if faces is not None and error is not None:
            raise MeshError("give faces or error, not both")
        if error is not None:
            return [mesh.at(error=error / scale) for mesh, scale in zip(self.meshes, self.scales(), strict=True)]
        if faces is None:
            return [mesh.restore() for mesh in self.meshes]
        counts = self._counts(faces)
        return [mesh.restore() if count >= mesh.face_count else mesh.at(faces=count)
                for mesh, count in zip(self.meshes, counts, strict=True)]

    def _counts(self, faces: int) -> list[int]:
        """Share triangles out as the file's order of batches does: each where the error is largest."""
        mesh, block = file_order([each.table for each in self.meshes], self.scales())
        after = np.array([self.meshes[index].batch_faces[number]
                          for index, number in zip(mesh.tolist(), block.tolist(), strict=True)])
        before = np.array([self.meshes[index].batch_faces[number - 1] if number else 0
                           for index, number in zip(mesh.tolist(), block.tolist(), strict=True)])
        whole = int(np.searchsorted(np.cumsum(after - before), faces, side="right"))
        whole = max(whole, len(self.meshes))
        counts = [int(after[:whole][mesh[:whole] == index][-1]) for index in range(len(self.meshes))]
        if whole < len(mesh):  # the next batch in part
            counts[mesh[whole]] += max(faces - sum(counts), 0)
        return counts

    def to_bytes(self, *, bits: int | None = None, keep_order: bool = False) -> bytes:
        """Return the file; see `Progressive.save`."""
        if not self.meshes:
            raise MeshError("there is no mesh to write")
        for entry in self.meta.get("objects", []):
            if not is_transform(entry["matrix"]):
                raise MeshError(f"{entry['name']} has a transform that is not finite: mend it")
        return encode([mesh.encoded(bits=bits, keep_order=keep_order) for mesh in self.meshes], self.meta,
                      self.scales())

    def save(self, path: str | os.PathLike[str], *, bits: int | None = None, keep_order: bool = False) -> int:
        """Write an .esopm file in one step; return its size. See `Progressive.save`."""
        return write_bytes(path, self.to_bytes(bits=bits, keep_order=keep_order))


def load_scene(path: str | os.PathLike[str], *, partial: bool = False, max_bytes: int | None = None) -> Scene:
    """Read an .esopm file with any number of meshes; see `load_progressive`."""
    return read_part(path, scene_from_bytes, partial=partial, max_bytes=max_bytes)


def scene_from_bytes(data: bytes, *, partial: bool = False) -> Scene:
    """Read a file from memory; see `load_scene`."""
    meshes, meta, damage = decode(data, partial=partial)
    read = [Progressive(patches, encoded.header.get("meta", {}), damage, encoded) for encoded, patches in meshes]
    return Scene(read, meta, damage)
