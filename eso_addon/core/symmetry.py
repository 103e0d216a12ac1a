# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetric results of symmetric meshes: one half is simplified with the plane held, the other is its image."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .attributes import AttributeSet
from .carried import Carried
from .closest import ClosestPoints
from .mesh import Bools, Floats, Ints, MeshError, weld

AXES = {"x": 0, "y": 1, "z": 2}
# vertices this near to each other's image, in sizes of the mesh, are a pair
_NEAR = 1e-5


@dataclass(frozen=True, eq=False)
class Mirror:
    """How the two halves of a mesh belong together.

    Attributes
    ----------
    axis : int
    half : ndarray, (h,) int64
        The faces on the side where the axis runs to.
    rest : ndarray, (r,) int64
        Faces in the plane or through it: they are not touched.
    image : ndarray, (n,) int64
        The vertex that is each vertex's image, of equal ones any; -1 where no face uses it.
    other : ndarray, (3 h,) int64
        The corner that is the image of each corner of the half.
    flat : ndarray, (n,) bool
        Vertices in the plane.
    locked : ndarray, (n,) bool
        Vertices of faces that are not touched.
    """

    axis: int
    half: Ints
    rest: Ints
    image: Ints
    other: Ints
    flat: Bools
    locked: Bools

    def of_half(self, attributes: AttributeSet, *, mirrored: bool = False) -> AttributeSet:
        """Return the attributes of the half's faces, or of their images."""
        corners = self.other if mirrored else (self.half[:, None] * 3 + np.arange(3)).ravel()
        rows = {"corner": corners, "face": corners[::3] // 3}
        if mirrored:
            rows["vertex"] = np.maximum(self.image, 0)
        layers = tuple(replace(layer, rows=layer.rows.take(rows[layer.domain], axis=0)) if layer.domain in rows
                       else layer for layer in attributes.layers)
        return replace(attributes, layers=layers)


def mirror_of(vertices: Floats, faces: Ints, name: str) -> Mirror:
    """Find the symmetry of a mesh.

    Parameters
    ----------
    vertices : ndarray, (n, 3) float64
    faces : ndarray, (m, 3) int64
    name : str
        "x", "y" or "z": the plane goes through the origin, across this axis.

    Raises
    ------
    MeshError
        A vertex or a face has no image, or nothing is beside the plane.
    """
    axis = AXES[name]
    used = np.unique(faces)
    size = float(np.ptp(vertices.take(used, axis=0), axis=0).max(initial=0.0))
    near = _NEAR * size
    image, apart = _images(vertices, used, axis)
    alone = int((apart > near).sum())
    if alone:
        raise MeshError(f"the mesh is not symmetric over {name.upper()}: {alone} vertices have no image on the other "
                        "side; symmetrize it first, or turn symmetry off")
    along = vertices[:, axis]
    flat = np.abs(along) <= near
    low, high = along.take(faces).min(axis=1), along.take(faces).max(axis=1)
    half = np.flatnonzero((low >= -near) & (high > near))
    rest = np.flatnonzero((high <= near) == (low >= -near))
    if len(half) == 0:
        raise MeshError(f"the mesh has no faces beside the plane of symmetry over {name.upper()}: turn symmetry off")
    locked = np.zeros(len(vertices), bool)
    locked[faces[rest]] = True
    other = _image_corners(vertices, faces, half, image)
    image[faces[half].ravel()] = faces.ravel().take(other)  # of equal vertices the one on the same side of a seam
    return Mirror(axis, half, rest, image, other, flat, locked)


def _images(vertices: Floats, used: Ints, axis: int) -> tuple[Ints, Floats]:
    """Return the vertex nearest to the image of each that is used, and how far it is from there."""
    mirrored = vertices.take(used, axis=0)
    mirrored[:, axis] *= -1
    closest, near, _ = ClosestPoints(vertices, np.repeat(used[:, None], 3, axis=1)).query(mirrored)
    image = np.full(len(vertices), -1)
    image[used] = used.take(near)
    return image, np.abs(closest - mirrored).max(axis=1)


def _image_corners(vertices: Floats, faces: Ints, half: Ints, image: Ints) -> Ints:
    """Return the corner of another face that is the image of each corner of the half's faces, (3 h,) int64.

    Where an edge runs the other way on the other side a corner's image is any with the same vertex.
    """
    one = weld(vertices)
    corners = one.take(faces)
    wanted = one.take(image.take(faces.take(half, axis=0)))
    sets = np.concatenate((np.sort(corners, axis=1), np.sort(wanted, axis=1)))
    number = np.unique(sets, axis=0, return_inverse=True)[1].ravel()
    face = np.full(int(number.max(initial=-1)) + 1, -1)
    face[number[: len(faces)]] = np.arange(len(faces))
    face = face.take(number[len(faces):])
    match = corners.take(face, axis=0)[:, None, :] == wanted[:, :, None]
    other = face[:, None] * 3 + match.argmax(axis=2)
    # quads that are cut along the other diagonal: any corner at the vertex will do
    at = np.zeros(len(vertices), np.int64)
    at[corners.ravel()] = np.arange(corners.size)
    return np.where((face >= 0)[:, None], other, at.take(wanted)).ravel()


def completed(half: Carried, images: dict[str, NDArray], mirror: Mirror, original: tuple[Floats, Ints],
              attributes: AttributeSet) -> Carried:
    """Put the image of a half beside it, and the faces that were not touched.

    Parameters
    ----------
    half : Carried
        Its face map names faces of the half.
    images : dict of str to ndarray
        The same attributes as the half's, with the values of the other side.
    mirror : Mirror
    original : tuple of ndarray
        The whole input: vertices (n, 3) float64 and faces (m, 3) int64.
    attributes : AttributeSet
        Of the whole input.
    """
    vertices, faces = original
    vertex_map = half.vertex_map.copy()
    shared = np.zeros(len(half.points), bool)
    shared[vertex_map[mirror.flat & (vertex_map >= 0)]] = True
    number = np.where(shared, np.arange(len(shared)), len(shared) - 1 + np.cumsum(~shared))
    partner = np.where(mirror.image >= 0, half.vertex_map.take(mirror.image, mode="clip"), -1)
    missing = (vertex_map < 0) & (partner >= 0)
    vertex_map[missing] = number.take(partner[missing])
    points = np.concatenate((half.points, half.points[~shared] * np.where(np.arange(3) == mirror.axis, -1, 1)))
    own = np.unique(faces[mirror.rest])
    own = own[vertex_map[own] < 0]
    vertex_map[own] = len(points) + np.arange(len(own))
    points = np.concatenate((points, vertices[own]))
    other_faces = mirror.other[::3] // 3
    corners = np.concatenate((half.corners, number.take(half.corners)[:, [0, 2, 1]], vertex_map[faces[mirror.rest]]))
    face_map = np.concatenate((mirror.half[half.face_map], other_faces[half.face_map], mirror.rest))
    carried, edges = {}, half.edges
    if len(attributes.edges):
        inside = (vertex_map[attributes.edges] >= 0) & mirror.locked[attributes.edges]
        rest = np.flatnonzero(inside.all(axis=1))
        every = np.concatenate((half.edges, number.take(half.edges), vertex_map[attributes.edges[rest]]))
        _, first = np.unique(np.sort(every, axis=1), axis=0, return_index=True)
        edges = every[first]
    for layer in attributes.layers:
        one, other = half.attributes[layer.name], images.get(layer.name, half.attributes[layer.name])
        rows, turned = one.reshape(-1, *layer.shape), other.reshape(-1, *layer.shape)
        if layer.domain == "vertex":
            parts = (rows, turned[~shared], layer.rows[own])
        elif layer.domain == "corner":
            turned = other.reshape(-1, 3, *layer.shape)[:, [0, 2, 1]].reshape(rows.shape)
            parts = (rows, turned, layer.rows.reshape(len(faces), 3, -1)[mirror.rest])
        elif layer.domain == "face":
            parts = (rows, turned, layer.rows[mirror.rest])
        else:
            parts = (rows, rows, layer.rows[rest])
        values = np.concatenate([part.reshape(-1, layer.rows.shape[1]) for part in parts])
        carried[layer.name] = layer.shaped(values[first] if layer.domain == "edge" else values)
    return Carried(points, corners, vertex_map, face_map, carried, edges)
