"""The contract of two-sided surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.geometry.shape import Shape


class Surface(Shape):
    """A thin sheet that particles touch from either side, and at its rims.

    A cylinder, for example, is a drum for particles inside and a rod for particles around it. A surface has
    faces, such as the lateral face and the two ends of a cylinder, and defines the nearest point of each.

    envelope : whether the lateral face is an envelope of tangent planes, which ``tangents`` defines. These
    are the surfaces that particles with shapes touch.
    """

    contract: ClassVar[bool] = True
    envelope: ClassVar[bool] = False
    least_rows: ClassVar[int] = 4

    @property
    def face_count(self) -> int:
        """Return the number of faces."""
        return 1

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield "faces", 1

    def values(self) -> list[float]:
        return [*super().values(), float(self.face_count)]

    def tangent_planes(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float, float]]:
        """Return the tangent planes of the lateral face at time 0: a point on its axis o (m), the unit vector
        e along the axis, or 0 for a sphere, and a, b, c (m) and L (m).

        A tangent plane has the normal n = a u + b e, away from the axis, with a unit vector u across the
        axis, and is at n . (r - o) = c. The face ends at 0 and L along the axis.
        """
        raise NotImplementedError

    @ti.func
    def nearest(self, w, k, c, r):
        """Return the point (m) nearest to r on face c of surface k; c is below ``faces(w, k)``."""
        return r

    @ti.func
    def tangents(self, w, k):
        """Return what ``tangent_planes`` does, with a, b, c and L as a vector."""
        nothing = ti.Vector([0.0, 0.0, 0.0])
        return nothing, nothing, ti.Vector([0.0, 0.0, 0.0, 0.0])

    @ti.func
    def distance(self, w, k, r):
        least = ti.cast(ti.math.inf, float)
        for c in range(ti.cast(self.faces(w, k), ti.i32)):
            least = ti.min(least, (r - self.nearest(w, k, c, r)).norm())
        return least
