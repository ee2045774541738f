"""Drag of a surrounding fluid on spheres (Z16 Eqs 3.6, 4.13 and section 4.2).

All laws have the form F = g u with u = v_f - v, the velocity of the fluid relative to the sphere: v_f is the
sum of all sources of a flow velocity, zero without any. The spheres exert no force on the fluid.

The law of Chow (``ChowDrag``) jumps at 3e5 from 0.5 to 0.080, as Z16 says, and also a little at 400 (0.5003
to 0.5) and 2e6 (0.1808 to 0.18). The law of Schiller and Naumann jumps at 1000, from 0.4383 to 0.44. Z16
prints the unit of viscosity as Pa/s; it is Pa s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, parameter
from tisim.numerics import elementary
from tisim.sources.base import Source, sources
from tisim.state.bound import Peers

LEAST_SPEED = 1e-30
"""Lower bound of the speed, in m/s, in divisions that give a direction; below it the direction has no
effect."""


class Drag(Force):
    """This is the contract of a drag law, F = g(|u|) u with u = v_f - v."""

    contract: ClassVar[bool] = True
    depends_on_velocity: ClassVar[bool] = True
    fields = ("radius", "velocity")

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"flow": sources(peers, "flow_velocity")}

    def resistance_of(self, radius: np.ndarray, speed: float) -> np.ndarray:
        """Return an upper bound of g (N s/m) of spheres of some radii (m) up to a speed (m/s) relative to the
        fluid."""
        raise NotImplementedError(f"{type(self).__name__} must define resistance_of")

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        if not self.offers("resistance_of"):
            return None
        flows = [one for one in effects if isinstance(one, Source) and one.quantity == "flow_velocity"]
        bounds = [one.strongest() for one in flows]
        if None in bounds:
            return None
        past = speed + float(np.linalg.norm(start["velocity"], axis=1).max(initial=0.0))
        g = self.resistance_of(start["radius"], past + sum(filter(None, bounds)))
        fastest = float((g / start["mass"]).max(initial=0.0))
        return 2 / fastest if fastest > 0 else math.inf

    def part_of_critical_step(self, accuracy: float) -> float:
        # Verlet uses the drag of half a step ago, which is an error of dt g / (2 m).
        return min(accuracy, super().part_of_critical_step(accuracy))

    @ti.func
    def resistance(self, s, w, i, speed):
        """Return g (N s/m) at this |u| (m/s), and its local exponent d ln g / d ln |u|."""
        return 0.0 * speed, 0.0 * speed

    @ti.func
    def approach(self, s, w, i, t):
        """Return u = v_f - v, in m/s."""
        u = -s.velocity[w, i]
        for source in ti.static(self.flow):
            u += source.value(w, s.position[w, i], t)
        return u

    @ti.func
    def force(self, s, w, i, t):
        u = self.approach(s, w, i, t)
        g, _power = self.resistance(s, w, i, u.norm())
        return g * u

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """Return dF/dv = -g (I + p u u^T / u^2) for g proportional to |u|^p, in N s/m."""
        u = self.approach(s, w, i, t)
        speed = u.norm()
        g, power = self.resistance(s, w, i, speed)
        along = (1.0 / ti.max(speed, LEAST_SPEED)) * u
        return -g * (ti.Matrix.identity(s.real, 3) + power * along.outer_product(along))


class ConstantDrag(Drag):
    """A fluid drags spheres with a constant drag coefficient.

        F = 1/2 rho_a C_D |u| u pi R^2,    u = v_f - v

    v_f is the sum of all sources of a flow velocity, zero without any.

    Source: Z16 Eq. (3.6).
    """

    density: float = parameter("kg/m^3", "density rho_a of the fluid", examples=[1.2], gt=0)
    coefficient: float = parameter("", "drag coefficient C_D", examples=[0.5], ge=0)

    def resistance_of(self, radius: np.ndarray, speed: float) -> np.ndarray:
        return 0.5 * self.density * self.coefficient * np.pi * radius**2 * speed

    @ti.func
    def resistance(self, s, w, i, speed):
        area = ti.math.pi * s.radius[w, i] ** 2
        return 0.5 * self.density(w) * self.coefficient(w) * area * speed, 1.0


class ChowDrag(Drag):
    """A fluid drags spheres with a drag coefficient that depends on the Reynolds number, in five pieces.

        F = 1/2 rho_a C_D(Re) |u| u pi R^2,    u = v_f - v,    Re = 2 R rho_a |u| / mu

        C_D = 24 / Re               0 < Re <= 1           which is Stokes's law
              24 / Re^0.646         1 < Re <= 400
              0.5                   400 < Re <= 3e5
              0.000366 Re^0.4275    3e5 < Re <= 2e6
              0.18                  2e6 < Re

    v_f is the sum of all sources of a flow velocity, zero without any.

    Source: Z16 section 4.2, after Chow (1979).
    """

    # The drag coefficient jumps.
    kinked: ClassVar[bool] = True

    density: float = parameter("kg/m^3", "density rho_a of the fluid", examples=[1.2], gt=0)
    viscosity: float = parameter("Pa s", "dynamic viscosity mu of the fluid", examples=[1.8e-5], gt=0)

    def resistance_of(self, radius: np.ndarray, speed: float) -> np.ndarray:
        # C_D is nowhere above the sum of Stokes's and Newton's coefficients, with 1 for Newton's.
        return np.pi * radius * (6 * self.viscosity + 0.5 * self.density * radius * speed)

    @ti.func
    def resistance(self, s, w, i, speed):
        radius = s.radius[w, i]
        reynolds = 2.0 * radius * self.density(w) / self.viscosity(w) * speed
        # C_D Re and its power of |u|: C_D alone is infinite at rest.
        drag, power = 24.0 + 0.0 * reynolds, 0.0 * reynolds
        if reynolds > 2e6:
            drag, power = 0.18 * reynolds, 1.0
        elif reynolds > 3e5:
            drag, power = 0.000366 * elementary.pow(reynolds, 1.4275), 1.4275
        elif reynolds > 400.0:
            drag, power = 0.5 * reynolds, 1.0
        elif reynolds > 1.0:
            drag, power = 24.0 * elementary.pow(reynolds, 0.354), 0.354
        # 1/2 rho_a C_D |u| pi R^2 = pi/4 mu R (C_D Re).
        return 0.25 * ti.math.pi * self.viscosity(w) * radius * drag, power


class SchillerNaumannDrag(Drag):
    """A fluid drags spheres by Stokes's law, corrected for larger Reynolds numbers by Schiller and Naumann.

        F = 1/2 rho_f C_D(Re) |u| u pi R^2,    u = v_f - v,    Re = 2 R rho_f |u| / mu

        C_D = 24 / Re (1 + 0.15 Re^0.687)    Re <= 1000
              0.44                           1000 < Re

    v_f is the sum of all sources of a flow velocity, zero without any. At Re = 1000 the coefficient jumps by
    0.4 %, from 0.4383 to 0.44. The law is accurate to some 5 % up to Re = 1000. The value 0.44 is the
    coefficient of Newton's regime, which ends near Re = 2e5, when the boundary layer becomes turbulent; the
    law does not describe the drop of the drag beyond. It holds for an isolated sphere: neighbours neither
    hinder nor shelter it.

    Source: L. Schiller, A. Naumann, Zeitschrift des VDI 77 (1933) 318.
    """

    # The drag coefficient jumps.
    kinked: ClassVar[bool] = True

    density: float = parameter("kg/m^3", "density rho_f of the fluid", examples=[1000.0], gt=0)
    viscosity: float = parameter("Pa s", "dynamic viscosity mu of the fluid", examples=[1e-3], gt=0)

    def resistance_of(self, radius: np.ndarray, speed: float) -> np.ndarray:
        reynolds = np.minimum(2 * radius * self.density / self.viscosity * speed, 1000.0)
        stokes = 6 * np.pi * self.viscosity * radius * (1 + 0.15 * reynolds**0.687)
        return np.maximum(stokes, 0.22 * self.density * np.pi * radius**2 * speed)

    @ti.func
    def resistance(self, s, w, i, speed):
        radius = s.radius[w, i]
        reynolds = 2.0 * radius * self.density(w) / self.viscosity(w) * speed
        # C_D Re and its power of |u|: C_D alone is infinite at rest.
        drag, power = 0.44 * reynolds, 1.0 + 0.0 * reynolds
        if reynolds <= 1000.0:
            correction = 0.15 * elementary.pow(reynolds, 0.687)
            drag, power = 24.0 * (1.0 + correction), 0.687 * correction / (1.0 + correction)
        # 1/2 rho_f C_D |u| pi R^2 = pi/4 mu R (C_D Re).
        return 0.25 * ti.math.pi * self.viscosity(w) * radius * drag, power


class StokesDrag(Drag):
    """A fluid drags spheres by Stokes's law, which holds for Reynolds numbers far below 1.

        F = 6 pi mu R u,    u = v_f - v

    v_f is the sum of all sources of a flow velocity, zero without any.

    Source: Z16 Eq. (4.13).
    """

    viscosity: float = parameter("Pa s", "dynamic viscosity mu of the fluid", examples=[1e-3], gt=0)

    def resistance_of(self, radius: np.ndarray, speed: float) -> np.ndarray:
        return 6 * np.pi * self.viscosity * radius

    @ti.func
    def resistance(self, s, w, i, speed):
        return 6.0 * ti.math.pi * self.viscosity(w) * s.radius[w, i], 0.0
