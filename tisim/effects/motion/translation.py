"""Translation at a constant velocity."""

from tisim.backend.taichi import ti
from tisim.effects.base import Vector, parameter
from tisim.effects.motion.base import Motion


class Translation(Motion):
    """The body moves at a constant velocity.

    x = v t
    """

    velocity: Vector = parameter("m/s", "velocity v", examples=[(0.1, 0.0, 0.0)])

    @ti.func
    def to_body(self, kept, w, r, t):
        return r - ti.cast(ti.cast(self.velocity(w), ti.f64) * t, float)

    @ti.func
    def from_body(self, kept, w, r, t):
        return r + ti.cast(ti.cast(self.velocity(w), ti.f64) * t, float)

    @ti.func
    def velocity_at(self, kept, w, r, t):
        return self.velocity(w)

    @ti.func
    def fastest(self, w, r, around):
        return self.velocity(w).norm()
