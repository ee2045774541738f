"""The velocity of a fluid driven through a constriction of a round duct (L21 section 3.4.4)."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.components.directed import Directed
from tisim.errors import must
from tisim.sources.base import Source, parameter


class ConstrictionFlow(Directed, Source):
    """A fluid is driven along a round duct and, faster, through its constriction; drag laws use its velocity.

        v = V p(rho) f(z, rho) n

        p = 1                                rho <= R_c          within the radius of the constriction
            (R - rho) / (R - R_c)            R_c < rho <= R      down to 0 at the wall of the duct
            0                                R < rho

        f = 1 + ((R / R_c)^2 - 1) g(z)       rho <= R_c          faster by the ratio of the areas
            1                                R_c < rho

        g = 1                                |z| <= L / 2        in the constriction
            1 - (|z| - L / 2) / b            up to L / 2 + b     in the transitions before and after it
            0                                beyond

    n is the unit vector along the axis, rho the distance from it, and z the coordinate along it from the
    middle of the constriction, of length L. L21 has no transitions, b = 0; the velocity then jumps at both
    ends. With transitions it is continuous along the axis. At rho = R_c it jumps in the constriction and in
    the transitions.

    The profile is meant to drag particles and does not solve the equations of a fluid. The velocity is along
    the axis everywhere, so its divergence, V (1 - (R / R_c)^2) / b sign(z), does not vanish in the
    transitions, and the flow rate through the constriction is 3 R^2 / (R^2 + R R_c + R_c^2) times the flow
    rate before and after it. Neither particles nor walls change it.

    Source: L21 section 3.4.4.
    """

    quantity = "flow_velocity"
    along: ClassVar[str] = "axis"
    unit: ClassVar[str] = "downstream"

    centre: Vector = parameter("m", "middle of the constriction, on the axis", (0.0, 0.0, 0.0))
    axis: Vector = parameter("", "direction n of the flow", (0.0, 0.0, 1.0))
    speed: float = parameter("m/s", "speed V on the axis, far from the constriction", examples=[0.273])
    throat_radius: float = parameter("m", "radius R_c of the constriction", examples=[6.6e-4], gt=0)
    duct_radius: float = parameter("m", "inner radius R of the duct", examples=[1.6e-3], gt=0)
    length: float = parameter("m", "length L of the constriction", examples=[1e-3], ge=0)
    transition: float = parameter("m", "length b of the transitions; 0 for jumps", 0.0, ge=0)

    kinked: ClassVar[bool] = True

    def strongest(self) -> float:
        return abs(self.speed) * (self.duct_radius / self.throat_radius) ** 2

    def shortest_length(self) -> float:
        return min(filter(None, (self.transition, self.length, self.throat_radius)))

    @model_validator(mode="after")
    def _narrow(self) -> ConstrictionFlow:
        rule = f"below {self.label}.duct_radius"
        must(self.throat_radius < self.duct_radius, f"{self.label}.throat_radius", rule, self.throat_radius)
        return self

    @ti.func
    def value(self, w, r, t):
        n, z, rho, _away = self.place(w, r)
        return self.speed(w) * self.across(w, rho)[0] * self.speeding_up(w, z, rho)[0] * n

    @ti.func
    def gradient(self, w, r, t):
        n, z, rho, away = self.place(w, r)
        p, dp = self.across(w, rho)
        f, df = self.speeding_up(w, z, rho)
        return self.speed(w) * n.outer_product(dp * f * away + p * df * n)

    @ti.func
    def place(self, w, r):
        """Return the unit vector along the axis, the coordinate along it (m), the distance from it (m), and
        the unit vector away from it, 0 on the axis."""
        n, out = self.downstream(w), r - self.centre(w)
        z = out.dot(n)
        across = out - z * n
        rho = across.norm()
        return n, z, rho, across / ti.select(rho > 0.0, rho, 1.0)

    @ti.func
    def across(self, w, rho):
        """Return p and its derivative by rho (1/m)."""
        slope = 1.0 / (self.duct_radius(w) - self.throat_radius(w))
        p = (self.duct_radius(w) - rho) * slope
        return ti.min(ti.max(p, 0.0), 1.0), ti.select(p > 0.0 and p < 1.0, -slope, 0.0)

    @ti.func
    def speeding_up(self, w, z, rho):
        """Return f and its derivative by z (1/m)."""
        ratio, width = self.duct_radius(w) / self.throat_radius(w), self.transition(w)
        more = ti.select(rho <= self.throat_radius(w), ratio * ratio - 1.0, 0.0)
        outside = ti.abs(z) - 0.5 * self.length(w)
        slope = 1.0 / ti.select(width > 0.0, width, 1.0)
        g = ti.select(width > 0.0, 1.0 - outside * slope, ti.select(outside <= 0.0, 1.0, 0.0))
        falls = width > 0.0 and g > 0.0 and g < 1.0
        df = ti.select(falls, -slope * ti.select(z > 0.0, 1.0, -1.0), 0.0)
        return 1.0 + more * ti.min(ti.max(g, 0.0), 1.0), more * df
