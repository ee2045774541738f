"""A plane with particles on one side."""

from __future__ import annotations

import math
from collections.abc import Iterator
from operator import mul
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Vector, parameter
from tisim.components.directed import Directed
from tisim.geometry.shape import SEAM, Shape, same_line


class Plane(Directed, Shape):
    """An infinite plane; particles are on the side to which its normal points.

    Its signed distance is d(r) = (r - point) . normal / |normal|.
    """

    along: ClassVar[str] = "normal"
    unit: ClassVar[str] = "direction"
    # The contact history of a grain takes memory for each wall in the capacity of the list.
    least_rows: ClassVar[int] = 8

    point: Vector = parameter("m", "a point on the plane", (0.0, 0.0, 0.0))
    normal: Vector = parameter("", "direction of the normal, towards the particles", (0.0, 0.0, 1.0))

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield "offset", 1

    def values(self) -> list[float]:
        return [*super().values(), math.fsum(map(mul, self.point, self.unit_vector()))]

    def ends_at(self, low: np.ndarray, high: np.ndarray, reach: float) -> np.ndarray:
        # An inclined plane meets opposite faces of the box at different positions.
        normal = np.array(self.normal)
        leans: np.ndarray = np.abs(normal) > SEAM * np.linalg.norm(normal)
        return leans

    def turns_into_itself(self, centre: np.ndarray, axis: np.ndarray) -> bool:
        return same_line(centre, np.array(self.unit_vector()), centre, axis)

    def distances(self, places: np.ndarray) -> np.ndarray:
        away: np.ndarray = (places - np.array(self.point)) @ np.array(self.unit_vector())
        return away

    @ti.func
    def distance(self, w, k, r):
        """Return the signed distance (m) of r from plane k, positive on the side of particles."""
        return r.dot(self.direction(w, k)) - self.offset(w, k)
