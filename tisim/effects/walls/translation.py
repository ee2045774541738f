"""Translation at a constant velocity from a given time on, such as the motion of a gate."""

import math
from collections.abc import Sequence

from tisim.backend.taichi import ti
from tisim.effects.base import Vector, parameter
from tisim.effects.walls.motion import Motion


class Translation(Motion):
    """The body rests at the position of its shapes until it begins to move at a constant velocity.

    x = v max(t - begin, 0)
    """

    velocity: Vector = parameter("m/s", "velocity v", examples=[(0.1, 0.0, 0.0)])
    begin: float = parameter("s", "time at which the body begins to move", 0.0, ge=0)

    def top_speed(self, extent: float) -> float:
        return math.hypot(*self.velocity)

    def shifts(self, duration: float) -> Sequence[Vector]:
        x, y, z = (max(duration - self.begin, 0.0) * component for component in self.velocity)
        return (0.0, 0.0, 0.0), (x, y, z)

    @ti.func
    def displacement(self, w, t):
        """Return the displacement (m) of the body from its shapes."""
        # In f64 for any precision, as the displacement grows without bound.
        moving = ti.max(t - ti.cast(self.begin(w), ti.f64), 0.0)
        return ti.cast(ti.cast(self.velocity(w), ti.f64) * moving, float)

    @ti.func
    def to_body(self, kept, w, r, t):
        return r - self.displacement(w, t)

    @ti.func
    def from_body(self, kept, w, r, t):
        return r + self.displacement(w, t)

    @ti.func
    def velocity_at(self, kept, w, r, t):
        return ti.select(t >= ti.cast(self.begin(w), ti.f64), 1.0, 0.0) * self.velocity(w)

    @ti.func
    def fastest(self, w, r, around):
        return self.velocity(w).norm()
