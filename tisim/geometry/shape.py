"""The contract of shapes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component

SEAM = 1e-6
"""What ends within this part of a box's side of a face ends at the face."""


def same_line(place: np.ndarray, direction: np.ndarray, centre: np.ndarray, axis: np.ndarray) -> bool:
    """Return whether a place lies on an axis through ``centre``, and a direction along it."""
    away = np.cross(place - centre, axis)
    size = np.linalg.norm(np.abs(place) + np.abs(centre))
    lies = np.linalg.norm(away) <= SEAM * size
    return bool(lies and np.linalg.norm(np.cross(direction, axis)) <= SEAM * np.linalg.norm(direction))


class Shape(Component):
    """A shape tells how far a place is from its surface. Most are rows of lists, as those of walls."""

    contract: ClassVar[bool] = True

    @classmethod
    def room(cls, rows: int) -> int:
        # A kind of which there is none costs nothing.
        return super().room(rows) if rows else 0

    def distances(self, places: np.ndarray) -> np.ndarray:
        """Return the distance (m) of each of some places (m, shape (n, 3)) from its surface, positive where
        particles are, shape (n,); by default infinite, so that a start is not checked for overlaps with a
        shape that does not tell it."""
        return np.full(len(places), np.inf)

    def extent(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the lowest and the highest coordinates (m, shape (3,)) that it reaches; None for one without
        end, and for one that does not tell."""
        return None

    def ends_at(self, low: np.ndarray, high: np.ndarray, reach: float) -> np.ndarray:
        """Return along which axes it ends, or bends, within reach (m) of two faces, at low and high (m, shape
        (3,)), shape (3,): an image of it at the other face would then be felt."""
        if (extent := self.extent()) is None:
            return np.zeros(3, bool)
        slack = SEAM * (high - low)
        near: np.ndarray = (extent[0] - reach < low) | (extent[1] + reach > high)
        return near & ~((extent[0] <= low + slack) & (extent[1] >= high - slack))

    def turns_into_itself(self, centre: np.ndarray, axis: np.ndarray) -> bool:
        """Return whether it is the same at any angle about an axis in a direction through a place (m)."""
        return False

    @ti.func
    def distance(self, w, k, r):
        """Return the distance (m) of r from shape k of world w, positive where particles are."""
        return 0.0 * r[0]
