"""The contract of two-sided surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.geometry.shape import Shape


class Surface(Shape):
    """A thin sheet that particles touch from either side, and at its rims.

    A cylinder, for example, is a drum for particles inside and a rod for particles around it. A surface has
    faces, such as the lateral face and the two ends of a cylinder, and defines the nearest point of each.
    """

    contract: ClassVar[bool] = True
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

    @ti.func
    def nearest(self, w, k, c, r):
        """Return the point (m) nearest to r on face c of surface k; c is below ``faces(w, k)``."""
        return r

    @ti.func
    def distance(self, w, k, r):
        least = ti.cast(ti.math.inf, float)
        for c in range(ti.cast(self.faces(w, k), ti.i32)):
            least = ti.min(least, (r - self.nearest(w, k, c, r)).norm())
        return least
