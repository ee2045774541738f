"""The Lorentz force on charged particles (Z13 Eqs 1-5, Z16 Eq. 2.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, option
from tisim.sources.base import Source, sources
from tisim.state.bound import Peers


class Lorentz(Force):
    """Electric and magnetic fields act on charged particles by the Lorentz force.

        F = q (E + v x B)

    E and B are the sums of all sources of each. The charge is a field of the particles (C). The force between
    charges is in ``near_field``. The fields of moving particles are neglected (Z16 section 7.7: far below the
    speed of light). Without ``magnetic`` only the electric force acts, as on a charge at rest. Use this in a
    scene whose magnetic field serves other effects and rotates no velocity during a run (q B t/m << 1).

    Source: Z13 Eqs (1)-(5).
    """

    depends_on_velocity: ClassVar[bool] = True
    fields = ("charge", "velocity")
    requires_source = ("electric_field", "magnetic_flux_density")

    magnetic: bool = option("whether a magnetic field acts on the charges too", True)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        if not self.magnetic:
            return math.inf
        fields = [one for one in effects if isinstance(one, Source)]
        bounds = [one.strongest() for one in fields if one.quantity == "magnetic_flux_density"]
        if None in bounds:
            return None
        charge = start.get("charge", np.zeros_like(start["mass"]))
        specific = float(np.abs(charge / start["mass"]).max(initial=0.0))
        rate = specific * sum(filter(None, bounds))
        return 2 / rate if rate > 0 else math.inf

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {name: sources(peers, name) for name in self.requires_source}

    def gyrates(self, effects: Sequence[Effect]) -> bool:
        sources = [one for one in effects if isinstance(one, Source)]
        return self.magnetic and any(
            one.quantity == "magnetic_flux_density" and one.strongest() != 0 for one in sources
        )

    @ti.func
    def flux_density(self, s, w, i, t):
        b = 0.0 * s.velocity[w, i]
        if ti.static(self.magnetic):
            for source in ti.static(self.magnetic_flux_density):
                b += source.value(w, s.position[w, i], t)
        return b

    @ti.func
    def force(self, s, w, i, t):
        field = s.velocity[w, i].cross(self.flux_density(s, w, i, t))
        for source in ti.static(self.electric_field):
            field += source.value(w, s.position[w, i], t)
        return s.charge[w, i] * field

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """Return d(q v x B)/dv = -q [B]x, where [B]x v = B x v, in N s/m."""
        b = self.flux_density(s, w, i, t)
        return s.charge[w, i] * ti.Matrix([[0.0, b[2], -b[1]], [-b[2], 0.0, b[0]], [b[1], -b[0], 0.0]])
