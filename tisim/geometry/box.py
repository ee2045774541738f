"""The surface of a box."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector, parameter
from tisim.errors import must
from tisim.geometry.surface import Surface


class BoxSurface(Surface):
    """The six faces of a box along the axes, with particles within or around it."""

    low: Vector = parameter("m", "corner of the least coordinates", (0.0, 0.0, 0.0))
    high: Vector = parameter("m", "corner of the largest coordinates", examples=[(0.1, 0.1, 0.1)])

    @model_validator(mode="after")
    def _wide(self) -> BoxSurface:
        wide = all(a < b for a, b in zip(self.low, self.high, strict=True))
        must(wide, f"{self.label}.high", f"above low, {self.low}, along each axis", self.high)
        return self

    @property
    def face_count(self) -> int:
        return 6

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.low), np.array(self.high)

    def distances(self, places: np.ndarray) -> np.ndarray:
        low, high = np.array(self.low), np.array(self.high)
        beyond = np.maximum(low - places, places - high)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return np.where(outside > 0.0, outside, -beyond.max(axis=1))

    @ti.func
    def nearest(self, w, k, c, r):
        low, high = self.low(w, k), self.high(w, k)
        place = ti.min(ti.max(r, low), high)
        for axis in ti.static(range(3)):
            if c // 2 == axis:
                place[axis] = ti.select(c % 2 == 0, low[axis], high[axis])
        return place
