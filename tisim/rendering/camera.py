"""The camera of pictures: a direction of view without perspective, and the part of space that is shown."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Camera:
    """A camera looks at space without perspective, with the z axis upright.

    azimuth : direction to the viewer from the x axis in the xy plane, degrees. elevation : of the viewer
        above the xy plane, degrees, -90 to 90.
    """

    azimuth: float = -62.0
    elevation: float = 18.0

    @cached_property
    def axes(self) -> np.ndarray:
        """Return the matrix that projects points to coordinates right, up and towards the viewer, shape
        (3, 3)."""
        turn, rise = np.radians(self.azimuth), np.radians(self.elevation)
        towards = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
        right = np.array([-np.sin(turn), np.cos(turn), 0.0])
        return np.stack([right, np.cross(towards, right), towards], axis=1)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the coordinates right, up and towards the viewer of points (m), shape (..., 3)."""
        return np.asarray(points, float) @ self.axes


USUAL_CAMERA = Camera()
"""The camera of pictures unless another is given."""


ALONG_Y = Camera(azimuth=-90.0, elevation=0.0)
"""The camera that looks along y: x is to the right and z upwards."""


class Window(NamedTuple):
    """The rectangle of the projection that a picture shows: left, bottom, width and height, m."""

    left: float
    bottom: float
    width: float
    height: float


@dataclass(frozen=True)
class Raster:
    """The pixels of a picture: a camera, a window, and the number of pixels across and upwards.

    Coordinates in pixels are right and up from the lower left corner, and towards the viewer.
    """

    camera: Camera
    window: Window
    columns: int
    rows: int

    @property
    def scale(self) -> float:
        """Return the number of pixels in 1 m."""
        return self.columns / self.window.width

    def place(self, points: np.ndarray) -> np.ndarray:
        """Return the coordinates in pixels of points (m), shape (..., 3)."""
        corner = np.array([self.window.left, self.window.bottom, 0.0])
        return np.asarray((self.camera.project(points) - corner) * self.scale)

    def finer(self, factor: int) -> Raster:
        """Return a raster with ``factor`` pixels along each side of one of this raster."""
        return Raster(self.camera, self.window, factor * self.columns, factor * self.rows)


@dataclass(frozen=True)
class ClipPlane:
    """A plane that cuts a part of space off: points with normal . r > offset are not drawn.

    normal : of any length but 0. offset : m times the length of the normal.
    """

    normal: tuple[float, float, float]
    offset: float

    def on(self, raster: Raster) -> tuple[np.ndarray, float]:
        """Return the unit normal and the offset in the pixels of a raster: normal . r <= offset is drawn."""
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        distance = self.offset / np.linalg.norm(self.normal)
        seen = normal @ raster.camera.axes
        corner = np.array([raster.window.left, raster.window.bottom, 0.0])
        return seen, float((distance - seen @ corner) * raster.scale)
