"""Loss in contact along the line of centres (Z16 Eq. 7.10)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import PairForce, parameter
from tisim.effects.contact.normal import NormalContact, area


class ContactDissipation(PairForce):
    """Touching grains lose energy along the line of centres, as by a dashpot.

        F_i = c_cd ((v_j - v_i) . n_ij) A n_ij

    A is the contact area and n_ij the unit vector from i to j. As in the paper the dashpot also acts on
    grains that separate: the sum of contact force and dissipation can be attractive just before they part.

    Source: Z16 Eq. (7.10).
    """

    short_ranged: ClassVar[bool] = True
    fields = ("radius", "velocity")
    depends_on_velocity: ClassVar[bool] = True
    requires: ClassVar = (NormalContact,)

    damping: float = parameter("N s/m^3", "damping coefficient c_cd per contact area", examples=[1e3], ge=0)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total = 0.0 * separation
        if distance <= s.radius[w, i] + s.radius[w, j]:
            n = separation / distance
            opening = s.relative_velocity(w, i, j, separation).dot(n)
            total = self.damping(w) * opening * area(s, w, i, j, distance) * n
        return total
