"""Magnetic moments in the field of the sources and of each other (L21 Eqs 2.6 and 4.12)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, SelfConsistentQuantity
from tisim.effects.magnetic.dipole_pairs import DipolePairs, dipole_field
from tisim.effects.magnetic.moment import FroehlichMoment, InducedMoment, LangevinMoment, Moment


def independent(moment: Moment, law: type[Moment]) -> Moment:
    """Return the law without mutual magnetisation, with the options of the law with mutual magnetisation."""
    return law(**{name: getattr(moment, name) for name in law.model_fields})


class LinearSpheres(SelfConsistentQuantity):
    """This is the contract of moments of linear spheres. Their influence on each other, weighted by the
    inverse volume, is symmetric, since all have the same chi."""

    contract: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    @ti.func
    def weight(self, s, w, i):
        return 1.0 / s.radius[w, i] ** 3


class MutualMoment(DipolePairs, SelfConsistentQuantity, Moment):
    """This is the contract of a moment that follows the field of the sources and of other moments.

        m_i = law(B(r_i) + sum_j f(x) B_j(r_i)),    B_j = mu_0 / (4 pi d^3) (3 (m_j.n) n - m_j)

    Each sphere is represented by a dipole at its centre; higher multipoles, which matter near contact, are
    neglected. In a periodic box only the nearest image of a particle acts. f is 1 for all pairs unless there
    is a ``cutoff``, as in ``truncated_dipole_dipole``, which must then have the same one.
    """

    contract: ClassVar[bool] = True
    independent_law: ClassVar[type[Moment]]
    """The law of a particle that the others do not magnetise."""

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (independent(self, self.independent_law), *super().approximations(extent))

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return the field (T) of j at i, reduced by the cut-off function."""
        field = dipole_field(s.moment[w, j], separation, distance)
        if ti.static(self.short_ranged):
            part, _slope = self.part(s, w, i, j, distance)
            field *= part
        return field


class MutualInducedMoment(LinearSpheres, MutualMoment, InducedMoment):
    """The sources and all other moments magnetise spheres of linear material.

        m_i = V_i 3 chi / (3 + chi) (B(r_i) + sum_j f(x) B_j(r_i)) / mu_0
        B_j = mu_0 / (4 pi d^3) (3 (m_j.n) n - m_j)                        the field of a dipole
        d_c = cutoff (R_i + R_j)/2 + gap,    x = d/d_c,    f(x) = 1 plain, 1 - 4 x^3 + 3 x^4 shifted

    With a = chi / (3 + chi) R^3 / d^3, each of two spheres at a distance d has 1 / (1 - 2 a) times the moment
    of a single sphere in a field along the line between them, and 1 / (1 + a) times in a field across it.
    Higher multipoles, which matter near contact, are neglected. In a periodic box only the nearest image of a
    particle acts.

    Source: L21 Eqs (2.6), (4.12).
    """

    independent_law = InducedMoment


class MutualLangevinMoment(MutualMoment, LangevinMoment):
    """The sources and all other moments magnetise superparamagnetic particles.

        m_i = m_s L(x) B/|B|,    L(x) = coth x - 1/x,    x = mu_d |B| / (k T)

    B is the field of the sources and of all other moments, each a dipole. Otherwise it is the same as
    ``langevin_moment``. B16 neglects the field of other moments, which matters only for weak fields (section
    6.2.4). In a periodic box only the nearest image of a particle acts.

    Source: B16 Eq. (6.22), L21 (2.6).
    """

    independent_law = LangevinMoment


class MutualFroehlichMoment(MutualMoment, FroehlichMoment):
    """The sources and all other moments magnetise spheres of iron or an oxide, whose magnetisation saturates.

        M_i = chi H M_s / (M_s + chi H),    H = |B(r_i) + sum_j f(x) B_j(r_i)| / mu_0 - M_i/3

    In weak fields it is the same as ``mutual_induced_moment``, and for isolated spheres the same as
    ``froehlich_moment``. Saturation limits moments for overlapping spheres, for which linear spheres have no
    solution. In a periodic box only the nearest image of a particle acts.

    Source: L21 Eqs (2.6), (4.12); the sources of ``froehlich_moment``.
    """

    independent_law = FroehlichMoment
