# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders: a z-buffer in numpy, flat shaded with wire, so that a page needs neither a GPU nor a display."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from benchmarks.readers import Mesh

SUPERSAMPLING = 2
PIXELS_AT_ONCE = 1 << 16
CLAY = (0.80, 0.79, 0.76)
INSIDE = (0.85, 0.55, 0.42)  # faces seen from behind: what is open reads as open
PAPER = (0.972, 0.976, 0.982)
# light from, in the camera's axes (right, up, towards the eye), and how strong
LIGHTS = (((-0.45, 0.65, 0.62), 0.62), ((0.85, 0.10, 0.40), 0.22), ((0.10, -0.85, 0.35), 0.08))
AMBIENT = 0.20
WIRE = 0.62
RATIOS = (0.62, 1.5)  # of a picture's height over its width
_EMPTY = np.iinfo(np.int64).max


@dataclass(frozen=True)
class Camera:
    """A camera without perspective.

    Attributes
    ----------
    axes : ndarray, (3, 3) float64
        Right, up, and towards the eye.
    centre : ndarray, (3,) float64
        What is in the middle of the picture.
    half : float
        Half of the picture's width, in the mesh's units.
    ratio : float
        The picture's height over its width.
    """

    axes: np.ndarray
    centre: np.ndarray
    half: float
    ratio: float = 1.0

    @classmethod
    def around(cls, vertices: np.ndarray, azimuth: float, elevation: float, up: str = "z", fill: float = 0.94) -> Self:
        """Look at a mesh from an azimuth and an elevation in degrees, so that it fills the picture."""
        vertical = np.eye(3)["xyz".index(up)]
        level = np.roll(np.eye(3), -(("xyz".index(up) + 1) % 3), axis=0)[:2]
        turn, rise = np.radians((azimuth, elevation))
        toward = np.cos(rise) * (np.cos(turn) * level[0] + np.sin(turn) * level[1]) + np.sin(rise) * vertical
        right = np.cross(vertical, toward)
        right /= np.linalg.norm(right)
        axes = np.stack((right, np.cross(toward, right), toward))
        seen = vertices @ axes[:2].T
        low, high = seen.min(axis=0), seen.max(axis=0)
        centre = (low + high) / 2 @ axes[:2]
        wide, tall = high - low
        ratio = float(np.clip(tall / max(wide, 1e-300), *RATIOS))
        return cls(axes, centre, float(max(wide, tall / ratio)) / 2 / fill, ratio)

    def close(self, x: float, y: float, zoom: float) -> Camera:
        """Look closer at a place, in halves of the picture's longer side; the picture is a square."""
        longer = self.half * max(1.0, self.ratio)
        return replace(self, centre=self.centre + longer * (x * self.axes[0] + y * self.axes[1]), half=longer / zoom,
                       ratio=1.0)


def render(mesh: Mesh, camera: Camera, wide: int = 640, *, colors: np.ndarray | None = None,
           wire: bool = True) -> np.ndarray:
    """Render a triangle mesh.

    Parameters
    ----------
    mesh : tuple of (n, 3) float64 and (m, 3) int64
    camera : Camera
    wide : int
        Pixels across.
    colors : ndarray, (n, 3) float64, optional
        From 0 to 1 at each vertex; clay where not given.
    wire : bool
        Draw the edges; they fade where triangles are of few pixels.

    Returns
    -------
    ndarray, (height, width, 3) uint8
    """
    vertices, faces = mesh
    tall = round(wide * camera.ratio)
    width, height = wide * SUPERSAMPLING, tall * SUPERSAMPLING
    scale = width / 2 / camera.half
    local = (vertices - camera.centre) @ camera.axes.T
    screen = np.stack((width / 2 + local[:, 0] * scale, height / 2 - local[:, 1] * scale, local[:, 2]), axis=1)
    seen = _Triangles.of(screen[faces])
    face = _visible(seen, width, height)
    picture = np.broadcast_to(PAPER, (height * width, 3)).copy()
    hits = np.flatnonzero(face >= 0)
    light = _light(vertices, faces, camera)
    for first in range(0, len(hits), PIXELS_AT_ONCE):
        hit = hits[first : first + PIXELS_AT_ONCE]
        at = face[hit]
        where = seen.barycentric(at, hit % width + 0.5, hit // width + 0.5)
        if colors is None:
            surface = np.where(seen.front[at][:, None], CLAY, INSIDE)
        else:
            surface = (np.clip(where, 0, 1)[:, :, None] * colors[faces[at]]).sum(axis=1)
        shade = light[at]
        if wire:
            shade *= 1 - _wire(where, seen.heights[at])
        picture[hit] = surface * shade[:, None]
    small = picture.reshape(tall, SUPERSAMPLING, wide, SUPERSAMPLING, 3).mean(axis=(1, 3))
    return (np.clip(small, 0, 1) * 255 + 0.5).astype(np.uint8)


@dataclass(frozen=True)
class _Triangles:
    """Triangles on the screen: what each corner counts at (x, y) is `edges @ (x, y, 1)`, (m, 3, 3)."""

    corners: np.ndarray  # (m, 3, 3): x, y and depth of each corner
    edges: np.ndarray
    heights: np.ndarray  # (m, 3) over the side opposite each corner, in pixels
    front: np.ndarray  # (m,) bool

    @classmethod
    def of(cls, corners: np.ndarray) -> Self:
        x, y = corners[:, :, 0], corners[:, :, 1]
        x1, x2, y1, y2 = np.roll(x, -1, axis=1), np.roll(x, -2, axis=1), np.roll(y, -1, axis=1), np.roll(y, -2, axis=1)
        area = x[:, 0] * (y1[:, 0] - y2[:, 0]) + x1[:, 0] * (y2[:, 0] - y[:, 0]) + x2[:, 0] * (y[:, 0] - y1[:, 0])
        edges = np.stack((y1 - y2, x2 - x1, x1 * y2 - x2 * y1), axis=2)
        edges /= np.where(np.abs(area) > 1e-9, area, np.inf)[:, None, None]
        heights = np.abs(area)[:, None] / np.maximum(np.hypot(x2 - x1, y2 - y1), 1e-12)
        return cls(corners, edges, heights, area < 0)  # rows of pixels run downwards

    def barycentric(self, face: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return what each corner counts at a pixel: (p, 3)."""
        edges = self.edges[face]
        return edges[:, :, 0] * x[:, None] + edges[:, :, 1] * y[:, None] + edges[:, :, 2]


def _visible(seen: _Triangles, width: int, height: int) -> np.ndarray:
    """Return the nearest face at each pixel, -1 where there is none: (height * width,) int64."""
    y, depth = seen.corners[:, :, 1], seen.corners[:, :, 2]
    top = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, height).astype(np.int64)
    end = np.clip(np.ceil(y.max(axis=1) - 0.5), 0, height).astype(np.int64)
    nearest = depth.max(initial=0)
    steps = (1 << 31) / max(nearest - depth.min(initial=0), 1e-300)
    plane = np.einsum("mi,mij->mj", depth, seen.edges)  # depth over the screen
    buffer = np.full(width * height, _EMPTY)
    for face, row in _expanded(np.arange(len(y)), top, np.maximum(end - top, 0)):
        left, right = _span(seen.edges[face], row + 0.5, width)
        for line, column in _expanded(np.arange(len(face)), left, np.maximum(right - left, 0)):
            at, x, y_at = face[line], column + 0.5, row[line] + 0.5
            behind = nearest - (plane[at, 0] * x + plane[at, 1] * y_at + plane[at, 2])
            keys = (np.clip(behind * steps, 0, (1 << 31) - 1).astype(np.int64) << 31) | at
            np.minimum.at(buffer, row[line] * width + column, keys)
    return np.where(buffer == _EMPTY, -1, buffer & ((1 << 31) - 1))


def _span(edges: np.ndarray, y: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first pixel of a triangle in a row, and one after the last."""
    rest = edges[:, :, 1] * y[:, None] + edges[:, :, 2]
    slope = edges[:, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -rest / slope
    left = np.where(slope > 0, crossing, np.where((slope == 0) & (rest < 0), np.inf, -np.inf)).max(axis=1)
    right = np.where(slope < 0, crossing, np.inf).min(axis=1)
    right = np.where((edges == 0).all(axis=(1, 2)), -np.inf, right)
    return tuple(np.clip(np.ceil(side - 0.5), 0, width).astype(np.int64) for side in (left, right))


def _expanded(items: np.ndarray, start: np.ndarray, count: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Repeat each item for `count` numbers from `start` on; in parts."""
    total = np.cumsum(count)
    first = 0
    while first < len(items):
        before = total[first - 1] if first else 0
        last = max(int(np.searchsorted(total, before + PIXELS_AT_ONCE, side="right")), first + 1)
        part = slice(first, last)
        first = last
        repeated = np.repeat(items[part], count[part])
        number = np.arange(len(repeated)) - np.repeat(total[part] - count[part] - before, count[part])
        yield repeated, number + np.repeat(start[part], count[part])


def _light(vertices: np.ndarray, faces: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the light on each face, either side of it."""
    a, b, c = (vertices[column] for column in faces.T)
    normals = np.cross(b - a, c - a) @ camera.axes.T
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    normals *= np.where(normals[:, 2:] < 0, -1, 1)
    light = np.full(len(faces), AMBIENT)
    for direction, strength in LIGHTS:
        light += strength * np.maximum(normals @ (np.array(direction) / np.linalg.norm(direction)), 0)
    return light * 1.4


def _wire(where: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Return how dark the edges make each pixel; nothing where triangles are too small for lines."""
    distance = (where * heights).min(axis=1)
    line = np.clip(0.5 * SUPERSAMPLING + 0.5 - distance, 0, 1)
    room = np.clip((heights.min(axis=1) / SUPERSAMPLING - 1.5) / 5, 0, 1)
    return WIRE * line * room
