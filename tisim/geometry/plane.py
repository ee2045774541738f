"""A plane, and the side of it on which particles are."""

from __future__ import annotations

import math
from collections.abc import Iterator
from operator import mul
from typing import ClassVar

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector, parameter
from tisim.components.ranges import check_direction
from tisim.geometry.shape import Shape


class Plane(Shape):
    """An infinite plane; particles are on the side that its normal points to.

    Its signed distance is d(r) = (r - point) . normal / |normal|.
    """

    # What a grain remembers of each wall takes memory, for every wall that there is room for.
    least_rows: ClassVar[int] = 8

    point: Vector = parameter("m", "a point of the plane", (0.0, 0.0, 0.0))
    normal: Vector = parameter("", "direction of the normal, towards the particles", (0.0, 0.0, 1.0))

    @model_validator(mode="after")
    def _directed(self) -> Plane:
        check_direction(f"{self.label}.normal", self.normal)
        return self

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield "direction", 3
        yield "offset", 1

    def values(self) -> list[float]:
        length = math.hypot(*self.normal)
        direction = [component / length for component in self.normal]
        return [*super().values(), *direction, math.fsum(map(mul, self.point, direction))]

    @ti.func
    def distance(self, w, k, r):
        """Return the signed distance (m) of r from plane k, positive where particles are."""
        return r.dot(self.direction(w, k)) - self.offset(w, k)
