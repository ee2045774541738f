"""Damping of viscoelastic spheres."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import Damping
from tisim.materials.materials import Touching


class ViscoelasticDamping(Damping):
    """Damping of viscoelastic spheres, whose restitution decreases with the speed of impact.

        gamma = A S

    Beside Hertz's force it is the law of Kuwabara and Kono, 2 A E* a v_n, with the A of Brilliantov and
    Poeschel: 1 - e grows as the fifth root of the speed. Beside Hooke's force it is a dashpot.

    Source: G. Kuwabara and K. Kono, Jpn. J. Appl. Phys. 26 (1987) 1230; N. V. Brilliantov, F. Spahn, J.-M.
    Hertzsch and T. Poeschel, Phys. Rev. E 53 (1996) 5382.
    """

    uses: ClassVar = ("viscous_time",)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"lag": pair.mixed("viscous_time")}

    @ti.func
    def coefficient(self, w, pair, stiffness, mass, factor):
        return self.lag(w, pair) * stiffness
