"""Cooling by convection and radiation between impacts (Z04 Eqs 6.19-6.21)."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, parameter
from tisim.effects.impact.heating import Heating
from tisim.operators.base import Operator
from tisim.state.bound import Peers
from tisim.state.fields import Field

STEFAN_BOLTZMANN = 5.670374419e-8
"""The Stefan-Boltzmann constant, W/(m^2 K^4), exact in SI to these digits; Z04 uses 5.67e-8. The constant in
scipy.constants has more digits, which would change the last bits of results."""
CONVERGED = {ti.f64: 1e-7, ti.f32: 1e-4}
"""Relative change at which Newton's iteration has converged. The error left is below 1.5 times its square,
because f''/(2 f') < 1.5/t for the equation below. A tolerance below rounding would never be met."""


class Cooling(Operator):
    """Grains exchange heat with a gas and, by radiation, with their surroundings.

        m C dT/dt = -h_c a_s (T - T_gas) - sigma eps a_s (T^4 - T_s^4),    a_s = 4 pi b^2

    b is the radius, C the specific heat capacity and sigma the Stefan-Boltzmann constant. The paper steps
    this equation explicitly (6.21). The temperature of a small hot grain then turns negative if a step of
    1e-6 s is longer than the grain takes to cool. Here the step is implicit (backward Euler, of the same
    accuracy). The equation for the new temperature is increasing and convex, so Newton's iteration converges
    to its only root, which lies between the old temperature and equilibrium.

    Source: Z04 Eq. (6.20).
    """

    fields = ("temperature", "radius", Field("cooling_loss", "J", 1, "sum"))
    requires: ClassVar[tuple[type[Effect], ...]] = (Heating,)

    emissivity: float = parameter("", "emissivity eps of the grains", 0.5, ge=0, le=1)
    surroundings: float = parameter("K", "temperature T_s of the surroundings of the grains", 300.0, ge=0)
    convection: float = parameter("W/(m^2 K)", "coefficient h_c of heat transfer by convection", 0.0, ge=0)
    gas: float = parameter("K", "temperature T_gas of the gas", 300.0, ge=0)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"heating": peers.of(Heating)[0]}

    @ti.func
    def particle(self, s, w, i, t, dt):
        capacity = s.mass[w, i] * self.heating.heat_capacity(w)
        per_kelvin = dt * 4.0 * ti.math.pi * s.radius[w, i] ** 2 / capacity
        a, c = STEFAN_BOLTZMANN * self.emissivity(w) * per_kelvin, self.convection(w) * per_kelvin
        before = s.temperature[w, i]
        # t + c t + a t^4 = before + c T_gas + a T_s^4, solved from above, so that Newton's iteration cannot
        # overshoot: t only falls, so the loop ends.
        right_side = before + c * self.gas(w) + a * self.surroundings(w) ** 4
        t = ti.max(before, ti.max(self.surroundings(w), self.gas(w)))
        change = t
        while change > ti.static(CONVERGED[s.real]) * t:
            cube = a * t * t * t
            change = (t + c * t + cube * t - right_side) / (1.0 + c + 4.0 * cube)
            t -= change
        s.temperature[w, i] = t
        s.cooling_loss[w, i] = s.cooling_loss[w, i] + capacity * (before - t)
