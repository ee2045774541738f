"""The contract of shapes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component


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

    @ti.func
    def distance(self, w, k, r):
        """Return the distance (m) of r from shape k of world w, positive where particles are."""
        return 0.0 * r[0]
