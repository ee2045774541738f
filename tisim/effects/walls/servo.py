"""A servo moves a wall until the particles resist it with a wanted force."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.directed import Directed
from tisim.effects.base import Vector, parameter
from tisim.effects.walls.motion import Motion

QUANTA = 2.0**32
"""Number of units in which the wanted resistance is counted."""
MOST_RESISTANCE = 2.0**8
"""Upper limit of the counted resistance of one particle, over the wanted force: a sum over 2^22 particles
stays below 2^63."""


class Servo(Directed, Motion):
    """The body moves along a direction until particles resist it with a wanted force.

        v = v_max (1 - P / F), within -v_max and v_max

    P is the force of the particles on the body, against the direction. The velocity in a step follows from
    the force at its beginning. The motion settles if F / (v_max dt) exceeds half of the stiffness (N/m) of
    the particles' resistance, and F / v_max exceeds its damping (N s/m). For a given pressure set F to
    pressure times area. The result contains the ``travel`` (m) along the direction and the ``speed`` (m/s).
    """

    quantities: ClassVar = {"travel": "m", "speed": "m/s", "moved_at": "s"}

    force: float = parameter("N", "wanted force F", examples=[10.0], gt=0)
    direction: Vector = parameter("", "direction in which it pushes", (0.0, 0.0, -1.0))
    limit: float = parameter("m/s", "speed v_max without resistance", examples=[0.1], gt=0)

    def shifts(self, duration: float) -> Sequence[Vector]:
        farthest = self.limit * duration * np.array(self.unit_vector())
        return tuple(farthest.tolist()), tuple((-farthest).tolist())

    @ti.func
    def displacement(self, kept, w, t):
        """Return the displacement (m) of the body from its shapes."""
        travel = kept.travel[w] + kept.speed[w] * (t - kept.moved_at[w])
        return ti.cast(travel, float) * self.axis(w)

    @ti.func
    def to_body(self, kept, w, r, t):
        return r - self.displacement(kept, w, t)

    @ti.func
    def from_body(self, kept, w, r, t):
        return r + self.displacement(kept, w, t)

    @ti.func
    def velocity_at(self, kept, w, r, t):
        return ti.cast(kept.speed[w], float) * self.axis(w)

    @ti.func
    def fastest(self, w, r, around):
        return self.limit(w)

    @ti.func
    def resistance(self, w, force):
        part = ti.cast(force.dot(self.axis(w)), ti.f64) / self.force(w)
        part = ti.min(ti.max(part, -MOST_RESISTANCE), MOST_RESISTANCE)
        return ti.cast(ti.round(part * QUANTA), ti.i64)

    @ti.func
    def end_step(self, kept, w, total, t):
        kept.travel[w] = kept.travel[w] + kept.speed[w] * (t - kept.moved_at[w])
        kept.moved_at[w] = t
        excess = ti.min(ti.max(ti.cast(total, ti.f64) / QUANTA - 1.0, -1.0), 1.0)
        kept.speed[w] = -ti.cast(self.limit(w), ti.f64) * excess
