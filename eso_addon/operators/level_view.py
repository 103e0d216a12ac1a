# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels to look at, quickly: positions and corners of any level of a recorded run."""

import numpy as np
from numpy.typing import NDArray

from ..bridge.read_mesh import MeshArrays
from ..core.recording import Recording
from .coloring import in_object_space


class LevelView:
    """Gives levels of a recording in an object's space.

    Parameters
    ----------
    recording : Recording
    source : MeshArrays
        What was recorded.
    """

    def __init__(self, recording: Recording, source: MeshArrays) -> None:
        mesh, record = recording.mesh, recording.record
        self._record = record
        self._points = in_object_space(recording.original[0][mesh.source], source)
        self._places = in_object_space(record.position, source)
        self._faces = np.ascontiguousarray(mesh.faces)
        self.most = mesh.faces.shape[1]
        self.least = max(int(record.faces_left[-1]), 1) if len(record) else self.most

    def at(self, share: float) -> tuple[int, NDArray[np.float32], NDArray[np.int32]]:
        """Give the level at a place between the coarsest, 0, and the mesh itself, 1.

        Equal steps divide the triangles by equal factors.

        Returns
        -------
        triangles : int
        points : ndarray, (n, 3) float32
            Of all vertices; only the corners' mean something.
        corners : ndarray, (m, 3) int32
        """
        wanted = round(self.least * (self.most / self.least) ** share)
        record = self._record
        length = record.length_for(wanted)
        survivor = record.survivors(len(self._points), length).astype(np.int32)
        points = self._points.copy()
        points[record.kept[:length]] = self._places[:length]
        a, b, c = (survivor.take(column) for column in self._faces)
        left = np.flatnonzero((a != b) & (b != c) & (c != a))
        return len(left), points, np.stack([corner.take(left) for corner in (a, b, c)], axis=1)
