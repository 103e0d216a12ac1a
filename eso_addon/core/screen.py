# SPDX-License-Identifier: GPL-3.0-or-later
"""How large things look: sizes and errors in pixels against distances from a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import Floats
from .options import number


@dataclass(frozen=True)
class Screen:
    """A camera's picture, and the error that is allowed in it.

    A length at a distance from the camera is `length * focal / distance` pixels long.

    Attributes
    ----------
    resolution : int
        Pixels along the wider side.
    lens, sensor : float
        Focal length, and the width of the sensor, in millimetres.
    pixels : float
        Largest error that may be seen, in pixels.
    aspect : float
        Width by height.
    """

    resolution: int = 1920
    lens: float = 50.0
    sensor: float = 36.0
    pixels: float = 1.0
    aspect: float = 16 / 9

    def __post_init__(self) -> None:
        number("resolution", self.resolution, 1, 1e6, whole=True)
        for name in ("lens", "sensor", "pixels", "aspect"):
            number(name, getattr(self, name), 1e-6, 1e6)

    @property
    def focal(self) -> float:
        """The distance, in lengths, from which a length looks one pixel long."""
        return self.lens / self.sensor * self.resolution

    def error_at(self, extent: float, size: float) -> float:
        """Return the error that may be seen just so when a length `extent` looks `size` pixels long."""
        return self.pixels * extent / number("screen size", size, 1e-6, 1e9)

    def distance_for_size(self, extent: float, size: float) -> float:
        """Return the distance from which a length `extent` looks `size` pixels long."""
        return extent * self.focal / number("screen size", size, 1e-6, 1e9)

    def distance_for_error(self, error: float) -> float:
        """Return the distance from which an error is not seen any more."""
        return error * self.focal / self.pixels

    def coverage(self, radius: float, distance: float) -> float:
        """Return the part of the picture, at most 1, that a sphere covers at a distance."""
        area = self.resolution * self.resolution / self.aspect
        return float(min(np.pi * (radius * self.focal / max(distance, 1e-30)) ** 2 / area, 1.0))


def extent_of(vertices: Floats, corners: np.ndarray) -> float:
    """Return the longest side of the bounding box of the vertices that are used."""
    used = vertices[np.unique(corners)]
    return float(np.ptp(used, axis=0).max()) if len(used) else 0.0
