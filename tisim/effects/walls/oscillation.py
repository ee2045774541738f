"""Oscillation along a line, such as the motion of a shaken plate."""

import math
from collections.abc import Sequence

from tisim.backend.taichi import ti
from tisim.effects.base import Vector, parameter
from tisim.effects.walls.motion import Motion
from tisim.numerics import elementary


class Oscillation(Motion):
    """The body oscillates about the position of its shapes.

    x = A sin(2 pi f t + phase)
    """

    amplitude: Vector = parameter("m", "amplitude A", examples=[(0.0, 0.0, 1e-3)])
    frequency: float = parameter("Hz", "frequency f", examples=[50.0], gt=0)
    phase: float = parameter("rad", "phase at t = 0", 0.0)

    def top_speed(self, extent: float) -> float:
        return 2 * math.pi * self.frequency * math.hypot(*self.amplitude)

    def shift(self) -> Vector:
        return self._swung(math.sin(self.phase))

    def shifts(self, duration: float) -> Sequence[Vector]:
        return (self.shift(), self._swung(1.0), self._swung(-1.0)) if duration > 0 else (self.shift(),)

    def _swung(self, part: float) -> Vector:
        x, y, z = (part * component for component in self.amplitude)
        return x, y, z

    @ti.func
    def angle(self, w, t):
        # In f64 for any precision, as the angle grows without bound.
        return 2.0 * math.pi * ti.cast(self.frequency(w), ti.f64) * t + self.phase(w)

    @ti.func
    def displacement(self, w, t):
        """Return the displacement (m) of the body from its shapes."""
        return ti.cast(elementary.sin(self.angle(w, t)), float) * self.amplitude(w)

    @ti.func
    def to_body(self, kept, w, r, t):
        return r - self.displacement(w, t)

    @ti.func
    def from_body(self, kept, w, r, t):
        return r + self.displacement(w, t)

    @ti.func
    def velocity_at(self, kept, w, r, t):
        rate = 2.0 * math.pi * self.frequency(w)
        return rate * ti.cast(elementary.cos(self.angle(w, t)), float) * self.amplitude(w)

    @ti.func
    def fastest(self, w, r, around):
        return 2.0 * math.pi * self.frequency(w) * self.amplitude(w).norm()
