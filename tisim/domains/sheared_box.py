"""A periodic box in simple shear, without walls."""

from __future__ import annotations

from typing import Any, Literal, Self

import numpy as np
from pydantic import model_validator

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.components.component import option, parameter
from tisim.domains.domain import Axes, Box
from tisim.errors import must

Axis = Literal["x", "y", "z"]


class ShearedBox(Box):
    """A periodic box in simple shear, with images that move past it at a constant rate.

        u(r) = rate r_g e_f,    a(t) = L_g e_g + rate L_g t e_f

    f is the flow axis and g the gradient axis. a(t) leads from a particle to its image one side L_g up the
    gradient, which moves at the relative velocity rate L_g; at time 0 the images are aligned. A particle that
    leaves through a face normal to the gradient is replaced by its image that enters through the opposite
    face, with the position and the velocity of the image. The system is therefore equivalent in all its
    layers and has no walls (Lees-Edwards boundary conditions).

    Only the images drive the flow: give the particles the initial velocity u, or wait until the flow has
    developed. Laws that depend on the velocities of two particles use the velocity of the image. A law that
    acts on single particles must be the same in all layers. Gravity is, and can be used; a fluid or a wall at
    rest is not, and is refused, like every effect that does not declare itself ``homogeneous``.

    Source: A. W. Lees, S. F. Edwards, J. Phys. C 5 (1972) 1921.
    """

    rate: float = parameter("1/s", "shear rate", examples=[10.0])
    flow: Axis = option("axis of the flow, along which images move", "x")
    gradient: Axis = option("gradient axis, along which the velocity of the flow increases", "y")

    @model_validator(mode="after")
    def _shears(self) -> Self:
        rule = f"another axis than {self.label}.flow"
        must(self.flow != self.gradient, f"{self.label}.gradient", rule, self.gradient)
        joined = self.periodic[self.along] and self.periodic[self.across]
        rule = f"true along flow and gradient, {self.flow} and {self.gradient}"
        must(joined, f"{self.label}.periodic", rule, self.periodic)
        must(self.images, f"{self.label}.images", "true", self.images)
        return self

    @property
    def along(self) -> int:
        """Return the index of the flow axis."""
        return "xyz".index(self.flow)

    @property
    def across(self) -> int:
        """Return the index of the gradient axis."""
        return "xyz".index(self.gradient)

    @property
    def real(self) -> Any:
        """Return the type of a length in kernels."""
        return runtime.current().real

    def cyclic(self) -> Axes:
        x, y, z = (joined and axis != self.across for axis, joined in enumerate(self.joined()))
        return x, y, z

    def shears(self) -> bool:
        return True

    def edges(self, time: float) -> np.ndarray:
        edges = super().edges(time)
        length, way = edges[self.along, self.along], self.rate * edges[self.across, self.across] * time
        edges[self.across, self.along] = way - length * np.round(way / length)
        return edges

    def streaming_velocity(self, position: np.ndarray) -> np.ndarray:
        u, middle = np.zeros_like(position), 0.5 * (self.low[self.across] + self.high[self.across])
        u[:, self.along] = self.rate * (position[:, self.across] - middle)
        return u

    @ti.func
    def shear_rate(self, w):
        return self.rate(w)

    @ti.func
    def streaming(self, w, r):
        u, middle = 0.0 * r, self.low(w)[self.across] + 0.5 * self.side(w)[self.across]
        u[self.along] = self.rate(w) * (r[self.across] - middle)
        return u

    @ti.func
    def speed(self, w):
        """Return the velocity (m/s), along the flow axis, of the image one side up the gradient."""
        return self.rate(w) * self.side(w)[self.across]

    @ti.func
    def offset(self, w, t):
        """Return the offset (m) along the flow axis of the image one side up the gradient, within half a
        side."""
        side = ti.cast(self.side(w), ti.f64)
        way = ti.cast(self.rate(w), ti.f64) * side[self.across] * t
        return ti.cast(way - side[self.along] * ti.round(way / side[self.along]), self.real)

    @ti.func
    def cross(self, w, r, t):
        """Return the position (m) inside the box of the image of r, and the number of sides that r is up the
        gradient."""
        low, side, place = self.low(w), self.side(w), r
        # Both are computed from one test of the faces; two tests could select different images.
        place[self.across], turns = self.enter(low[self.across], side[self.across], r[self.across])
        place[self.along] -= turns * self.offset(w, t)
        for k in ti.static(range(3)):
            if ti.static(self.periodic[k] and k != self.across):
                place[k], _turns = self.enter(low[k], side[k], place[k])
        return place, turns

    @ti.func
    def wrap(self, w, r, t):
        place, _turns = self.cross(w, r, t)
        return place

    @ti.func
    def put(self, s, w, i, r, t):
        s.position[w, i], turns = self.cross(w, r, t)
        s.velocity[w, i][self.along] = s.velocity[w, i][self.along] - turns * self.speed(w)

    @ti.func
    def turn(self, w, a, b):
        d, half = b[self.across] - a[self.across], 0.5 * self.side(w)[self.across]
        return ti.select(d < -half, 1, 0) - ti.select(d > half, 1, 0)

    @ti.func
    def nearest(self, w, a, b, t):
        d, turn = b - a, ti.cast(self.turn(w, a, b), self.real)
        d[self.across] += turn * self.side(w)[self.across]
        d[self.along] += turn * self.offset(w, t)
        return self.shortest(w, d)

    @ti.func
    def seen_from(self, w, r, turn, t):
        place, low, side = r, self.low(w)[self.along], self.side(w)[self.along]
        place[self.across] -= turn * self.side(w)[self.across]
        x = r[self.along] - turn * self.offset(w, t)
        place[self.along] = x + ti.select(x < low, side, 0.0) - ti.select(x >= low + side, side, 0.0)
        return place

    @ti.func
    def relative_velocity(self, s, w, i, j, separation):
        direct = s.position[w, j][self.across] - s.position[w, i][self.across]
        turned, half = separation[self.across] - direct, 0.5 * self.side(w)[self.across]
        turn = ti.select(turned > half, 1.0, 0.0) - ti.select(turned < -half, 1.0, 0.0)
        v = s.velocity[w, j] - s.velocity[w, i]
        v[self.along] += turn * self.speed(w)
        return v
