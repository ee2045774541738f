"""Damping by a coefficient of restitution."""

from __future__ import annotations

import math
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import Damping
from tisim.materials.materials import Touching


class RestitutionDamping(Damping):
    """Damping that gives an impact along the line of centres its coefficient of restitution at any speed.

        gamma = c sqrt(S m*),    c = -2 f ln e / sqrt(ln^2 e + pi^2)

    f is 1 beside Hooke's spring and sqrt(5/6) beside Hertz's. The normal force is slightly attractive before
    surfaces part. At e = 0, with c = 2 f, the damping is critical: surfaces come to rest and never part by
    themselves; beside Hooke's spring the overlap is delta = v t exp(-t sqrt(k / m*)).

    It is ``coeff_restitution`` of LAMMPS. The polynomial of Tsuji, Tanaka and Ishida, written for the mass of
    one of two equal grains, gives the same e to 0.002 for e of 0.05 and above. ``tsuji`` of LAMMPS inserts m*
    instead, so that its e = 0.5 is an e of 0.62.

    Source: Y. Tsuji, T. Tanaka and T. Ishida, Powder Technol. 71 (1992) 239, who fit c; D. Antypov and J. A.
    Elliott, EPL 94 (2011) 50004, who found it.
    """

    uses: ClassVar = ("restitution",)

    def mix(self, pair: Touching) -> dict[str, float]:
        restitution = pair.mixed("restitution")
        if restitution == 0:
            # The limit of the formula below, in which the logarithm diverges.
            return {"loss": 2.0}
        logarithm = math.log(restitution)
        return {"loss": -2 * logarithm / math.hypot(logarithm, math.pi)}

    @ti.func
    def coefficient(self, w, pair, stiffness, mass, factor):
        return factor * self.loss(w, pair) * ti.sqrt(stiffness * mass)
