"""Friction without history."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.granular.parts import TangentialForce
from tisim.materials.materials import Touching


class ViscousFriction(TangentialForce):
    """A dashpot without history resists the sliding of surfaces, up to Coulomb's limit.

        F_t = min(gamma_t |u|, mu N) u / |u|,    gamma_t = x gamma_n

    Two grains that are pressed together creep past each other under any load. It is ``linear_nohistory`` of
    LAMMPS.

    Source: P. K. Haff and B. T. Werner, Powder Technol. 48 (1986) 239.
    """

    uses: ClassVar = ("friction",)

    damping_ratio: float = parameter("", "tangential over normal damping, x", 1.0, ge=0)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"slope": pair.mixed("friction")}

    @ti.func
    def dashpot(self, w, pair, damping):
        return self.damping_ratio(w) * damping

    @ti.func
    def coulomb(self, w, pair):
        return self.slope(w, pair)

    @ti.func
    def force(self, w, pair, normal, stiffness, damping, limit, sliding, past, dt):
        grip, most = self.dashpot(w, pair, damping) * sliding, self.slope(w, pair) * limit
        square = grip.norm_sqr()
        if square > most * most:
            grip *= most / ti.sqrt(square)
        return grip, past
