"""Magnetic moments in the field of the sources and of each other (L21 Eqs 2.6 and 4.12)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, SelfConsistentQuantity
from tisim.effects.magnetic.dipole_pairs import DipolePairs, dipole_field
from tisim.effects.magnetic.moment import InducedMoment, LangevinMoment, Moment


class MutualMoment(DipolePairs, SelfConsistentQuantity, Moment):
    """This is the contract of a moment that follows the field of the sources and of other moments.

        m_i = law(B(r_i) + sum_j f(x) B_j(r_i)),    B_j = mu_0 / (4 pi d^3) (3 (m_j.n) n - m_j)

    A dipole at its centre stands for each sphere: near contact the higher multipoles, which are left out,
    matter as well. In a periodic box only the nearest image of a particle acts. f is 1 for all pairs, unless
    there is a cut-off (``DipolePairs``); forces need the same one, in ``truncated_dipole_dipole``.
    """

    contract: ClassVar[bool] = True
    independent_law: ClassVar[type[Moment]]
    """This law is that of a particle that the others do not magnetise."""

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        options = {name: getattr(self, name) for name in self.independent_law.model_fields}
        return (self.independent_law(**options), *super().approximations(extent))

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return the field (T) of j at i, as far as it counts."""
        field = dipole_field(s.moment[w, j], separation, distance)
        if ti.static(self.short_ranged):
            part, _slope = self.part(s, w, i, j, distance)
            field *= part
        return field


class MutualInducedMoment(MutualMoment, InducedMoment):
    """Spheres of linear material are magnetised by the sources and by each other.

        m_i = V_i 3 chi / (3 + chi) (B(r_i) + sum_j B_j(r_i)) / mu_0
        B_j = mu_0 / (4 pi d^3) (3 (m_j.n) n - m_j)                        the field of a dipole

    Two at a distance d, with a = chi / (3 + chi) R^3 / d^3, have 1 / (1 - 2 a) times the moment of one alone
    along the line between them, 1 / (1 + a) across it. Near contact the higher multipoles, which are left
    out, matter as well. In a periodic box only the nearest image of a particle acts.

    Source: L21 Eqs (2.6), (4.12).
    """

    independent_law = InducedMoment


class MutualLangevinMoment(MutualMoment, LangevinMoment):
    """Superparamagnetic particles are magnetised by the sources and by each other.

        m_i = m_s L(x) B/|B|,    L(x) = coth x - 1/x,    x = mu_d |B| / (k T)

    B is that of the sources and of all other moments, each a dipole; the rest is as in ``langevin_moment``.
    B16 leaves this out, as it matters for weak fields only (section 6.2.4). In a periodic box only the
    nearest image of a particle acts.

    Source: B16 Eq. (6.22), L21 (2.6).
    """

    independent_law = LangevinMoment
