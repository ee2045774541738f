"""Magnetic moments in the field of the sources and of each other, with all images of a periodic box."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.effects.base import Effect, SelfConsistentQuantity
from tisim.effects.magnetic.ewald_pairs import EwaldPairs
from tisim.effects.magnetic.moment import FroehlichMoment, InducedMoment, LangevinMoment, Moment
from tisim.effects.magnetic.mutual_moment import LinearSpheres, independent
from tisim.effects.magnetic.wave_sum import WaveSum

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.effects.base import LongRange, LongRangeSum
    from tisim.state.bound import Bound
    from tisim.state.state import State


class EwaldMoment(EwaldPairs, SelfConsistentQuantity, Moment):
    """This is the contract of a moment that follows the field of the sources and of all other moments, with
    all their images in a periodic box.

        m_i = law(B(r_i) + B_i),    B_i = -dU / dm_i

    U is the Ewald sum of ``ewald_dipole_dipole``; its sum over waves is recomputed in each sweep.
    """

    contract: ClassVar[bool] = True
    independent_law: ClassVar[type[Moment]]
    """The law of a particle that the others do not magnetise."""

    @property
    def accuracy_parameters(self) -> tuple[AccuracyParameter, ...]:  # type: ignore[override]
        return (*EwaldPairs.accuracy_parameters, *self.sweep_parameters())

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return (independent(self, self.independent_law), *super().approximations(extent))

    def long_range_sum(self, own: Bound[LongRange], s: State, domain: Bound[Domain]) -> LongRangeSum:
        return WaveSum(s, own, domain, forces=False)

    @ti.func
    def influence(self, s, w, i, j, separation, distance, t):
        """Return the contribution of near pairs to the field (T) of j at i."""
        return self.near_field(s, w, j, separation, distance)

    @ti.func
    def response(self, s, w, i, total, t):
        return self.law(s, w, i, self.with_sources(s, w, i, total + self.sum.field[w, i], t))


class EwaldInducedMoment(LinearSpheres, EwaldMoment, InducedMoment):
    """The sources and all other moments, with their periodic images, magnetise spheres of linear material.

        m_i = V_i 3 chi / (3 + chi) (B(r_i) + B_i) / mu_0,    B_i = -dU / dm_i

    U is the Ewald sum of all dipoles, which ``ewald_dipole_dipole`` also uses for the forces on these
    moments. On a simple cubic lattice of n spheres per unit volume the field of the others is mu_0 M/3. The
    magnetisation then follows Clausius and Mossotti, M = n g B / (1 - n g mu_0 / 3) with m = g B for each
    sphere; B is then the field within the sample, unless there are ``demagnetising_factors``. Otherwise it is
    the same as ``mutual_induced_moment``.

    Source: S. W. de Leeuw, J. W. Perram, E. R. Smith, Proc. R. Soc. Lond. A 373 (1980) 27; Z. Wang, C. Holm,
    J. Chem. Phys. 115 (2001) 6351; L21 Eqs (2.6), (4.12).
    """

    independent_law = InducedMoment


class EwaldLangevinMoment(EwaldMoment, LangevinMoment):
    """The sources and all other moments, with their periodic images, magnetise superparamagnetic particles.

        m_i = m_s L(x) B/|B|,    L(x) = coth x - 1/x,    x = mu_d |B| / (k T)

    B is the field of the sources plus the Ewald sum of all dipoles, as in ``ewald_dipole_dipole``. Otherwise
    it is the same as ``mutual_langevin_moment``.

    Source: B16 Eq. (6.22), L21 (2.6); the sources of ``ewald_induced_moment``.
    """

    independent_law = LangevinMoment


class EwaldFroehlichMoment(EwaldMoment, FroehlichMoment):
    """The sources and all other moments, with their periodic images, magnetise spheres of iron or an oxide.

        M_i = chi H M_s / (M_s + chi H),    H = |B(r_i) + B_i| / mu_0 - M_i/3,    B_i = -dU / dm_i

    The magnetisation saturates. U is the Ewald sum of all dipoles, as in ``ewald_dipole_dipole``. Otherwise
    it is the same as ``mutual_froehlich_moment``.

    Source: L21 Eqs (2.6), (4.12); the sources of ``froehlich_moment`` and of ``ewald_induced_moment``.
    """

    independent_law = FroehlichMoment
