"""The contract of shapes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component

SEAM = 1e-6
"""Relative tolerance, in sides of a box, within which the end of a shape counts as at a face."""


def same_line(place: np.ndarray, direction: np.ndarray, centre: np.ndarray, axis: np.ndarray) -> bool:
    """Return whether a point lies on an axis through ``centre``, and a direction is parallel to it."""
    away = np.cross(place - centre, axis)
    size = np.linalg.norm(np.abs(place) + np.abs(centre))
    lies = np.linalg.norm(away) <= SEAM * size
    return bool(lies and np.linalg.norm(np.cross(direction, axis)) <= SEAM * np.linalg.norm(direction))


class Shape(Component):
    """A shape defines the distance of points from its surface. Most shapes are rows of lists, such as
    walls."""

    contract: ClassVar[bool] = True

    @classmethod
    def list_capacity(cls, rows: int) -> int:
        # A kind of shape without rows takes no memory.
        return super().list_capacity(rows) if rows else 0

    def distances(self, places: np.ndarray) -> np.ndarray:
        """Return the distance (m) of each position (m, shape (n, 3)) from its surface, positive on the side
        of particles, shape (n,). The default is infinite, which disables the check of a start for overlaps
        with the shape."""
        return np.full(len(places), np.inf)

    def extent(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the lowest and the highest coordinates (m, shape (3,)) of the shape; None if it is unbounded
        or does not define them."""
        return None

    def ends_at(self, low: np.ndarray, high: np.ndarray, reach: float) -> np.ndarray:
        """Return the axes along which the shape ends, or bends, within reach (m) of the faces at low and high
        (m, shape (3,)), shape (3,). Particles there would have to interact with its image at the opposite
        face."""
        if (extent := self.extent()) is None:
            return np.zeros(3, bool)
        slack = SEAM * (high - low)
        near: np.ndarray = (extent[0] - reach < low) | (extent[1] + reach > high)
        return near & ~((extent[0] <= low + slack) & (extent[1] >= high - slack))

    def turns_into_itself(self, centre: np.ndarray, axis: np.ndarray) -> bool:
        """Return whether the shape is symmetric under all rotations about an axis through a point (m)."""
        return False

    @ti.func
    def distance(self, w, k, r):
        """Return the distance (m) of r from shape k of world w, positive on the side of particles."""
        return 0.0 * r[0]
