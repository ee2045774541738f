"""The contract of shapes."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import Component


class Shape(Component):
    """A shape tells how far a place is from its surface; it is a row of a list, such as that of walls."""

    contract: ClassVar[bool] = True

    @ti.func
    def distance(self, w, k, r):
        """Return the signed distance (m) of r from shape k of world w, positive where particles are."""
        return 0.0 * r[0]
