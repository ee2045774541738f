"""The velocity of a fluid between two walls that slide past each other (L21 section 2.2.2)."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.components.directed import Directed
from tisim.errors import must
from tisim.sources.base import Source, parameter


class CouetteFlow(Directed, Source):
    """A fluid is sheared between two parallel walls that slide past each other; drag laws use its velocity.

        v = v_1 + (x - x_1) / (x_2 - x_1) (v_2 - v_1),    x = r.n

    n is the unit normal of the walls, x_1 and x_2 are their positions along it. Beyond a wall the fluid moves
    with the wall. The flow is free of divergence if v_1 and v_2 are parallel to the walls, as for sliding
    walls. The fluid is at rest before ``begin`` and in steady flow afterwards; the diffusion of shear across
    the gap, in a time of (x_2 - x_1)^2 rho / mu, is neglected. Neither particles nor walls of the scene
    change the flow.

    Source: L21 section 2.2.2, figure 2.4.
    """

    quantity = "flow_velocity"
    along: ClassVar[str] = "normal"
    unit: ClassVar[str] = "across"

    normal: Vector = parameter("", "normal n of both walls", (0.0, 0.0, 1.0))
    first: float = parameter("m", "position x_1 of the first wall along the normal", examples=[0.0])
    second: float = parameter("m", "position x_2 of the second wall along the normal", examples=[1e-3])
    first_velocity: Vector = parameter("m/s", "velocity v_1 of the first wall", examples=[(-0.1, 0.0, 0.0)])
    second_velocity: Vector = parameter("m/s", "velocity v_2 of the second wall", examples=[(0.1, 0.0, 0.0)])

    begin: float = parameter("s", "time at which the walls begin to move", 0.0, ge=0)

    kinked: ClassVar[bool] = True

    def strongest(self) -> float:
        return max(math.hypot(*self.first_velocity), math.hypot(*self.second_velocity))

    def shortest_length(self) -> float:
        return self.second - self.first

    @model_validator(mode="after")
    def _apart(self) -> CouetteFlow:
        must(self.first < self.second, f"{self.label}.second", f"above {self.label}.first", self.second)
        return self

    @ti.func
    def value(self, w, r, t):
        first, change = self.first_velocity(w), self.second_velocity(w) - self.first_velocity(w)
        return self.moving(w, t) * (first + ti.min(ti.max(self.part(w, r), 0.0), 1.0) * change)

    @ti.func
    def gradient(self, w, r, t):
        part, change = self.part(w, r), self.second_velocity(w) - self.first_velocity(w)
        rate = ti.select(part >= 0.0 and part <= 1.0, 1.0 / (self.second(w) - self.first(w)), 0.0)
        return self.moving(w, t) * rate * change.outer_product(self.across(w))

    @ti.func
    def moving(self, w, t):
        """Return 1 from the time at which the walls begin to move, 0 before."""
        return ti.select(t >= self.begin(w), 1.0, 0.0)

    @ti.func
    def part(self, w, r):
        """Return the relative position of r (m) between the walls, 0 at the first and 1 at the second."""
        return (r.dot(self.across(w)) - self.first(w)) / (self.second(w) - self.first(w))
