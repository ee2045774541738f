"""Rotation about an axis at a constant rate, such as the motion of a drum."""

import math
from collections.abc import Iterator

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Vector, parameter
from tisim.effects.walls.motion import Motion
from tisim.numerics import elementary


class Rotation(Motion):
    """The body rotates about an axis at a constant rate.

    v = Omega x (r - c)

    The reported torque on the body is about c.
    """

    rate: Vector = parameter("rad/s", "angular velocity Omega", examples=[(0.0, 1.0, 0.0)])
    centre: Vector = parameter("m", "a point c on the axis", (0.0, 0.0, 0.0))

    def centre_of_torque(self) -> Vector:
        return self.centre

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield from (("axis", 3), ("size", 1))

    def values(self) -> list[float]:
        size = math.hypot(*self.rate)
        axis = [component / size for component in self.rate] if size > 0 else [0.0, 0.0, 1.0]
        return [*super().values(), *axis, size]

    def axis(self) -> tuple[np.ndarray, np.ndarray] | None:
        size = math.hypot(*self.rate)
        return (np.array(self.centre), np.array(self.rate) / size) if size > 0 else None

    def top_speed(self, extent: float) -> float:
        # In open space the extent of the body is unknown.
        return math.hypot(*self.rate) * extent if math.isfinite(extent) else 0.0

    @ti.func
    def turned(self, w, d, t):
        """Return a vector d rotated about the axis by Omega t (O. Rodrigues, 1840)."""
        # In f64 for any precision, as the angle grows without bound.
        angle = ti.cast(self.size(w), ti.f64) * t
        cosine, sine = ti.cast(elementary.cos(angle), float), ti.cast(elementary.sin(angle), float)
        axis = self.axis(w)
        along = axis.dot(d) * axis
        return along + cosine * (d - along) + sine * axis.cross(d)

    @ti.func
    def to_body(self, kept, w, r, t):
        return self.centre(w) + self.turned(w, r - self.centre(w), -t)

    @ti.func
    def from_body(self, kept, w, r, t):
        return self.centre(w) + self.turned(w, r - self.centre(w), t)

    @ti.func
    def to_space(self, kept, w, direction, t):
        return self.turned(w, direction, t)

    @ti.func
    def velocity_at(self, kept, w, r, t):
        return self.rate(w).cross(r - self.centre(w))

    @ti.func
    def angular_velocity(self, w):
        return self.rate(w)

    @ti.func
    def fastest(self, w, r, around):
        return self.size(w) * ((r - self.centre(w)).norm() + around)
