"""Forces between magnetic moments (B16 Eqs 6.21 to 6.23, L21 Eqs 4.6 to 4.9)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import three_digits
from tisim.effects.base import Effect, PairForce, parameter
from tisim.effects.magnetic.dipole_pairs import DipolePairs, Dipoles, dipole_field
from tisim.effects.magnetic.moment import MOMENT
from tisim.effects.magnetic.permanent_moment import PermanentMoment
from tisim.state.bound import Peers

CUTOFFS = (10.0, 20.0, 30.0, 60.0)
"""Cut-offs, in radii, that are tried as approximations."""
NEARER = (0.5, 0.7)
"""A law with a cut-off is compared with laws whose cut-off beyond contact is reduced to these fractions."""


class DipoleDipole(Dipoles, PairForce):
    """Magnetic moments attract, repel and rotate each other as dipoles, over all pairs.

        F_i = -grad_i U,    U = -mu_0 / (4 pi) (3 (m_i.n)(m_j.n) - m_i.m_j) / d^3
            = -3 mu_0 / (4 pi d^4) [(m_i.n) m_j + (m_j.n) m_i + (m_i.m_j) n - 5 (m_i.n)(m_j.n) n]
        T_i = m_i x B_j,    B_j = mu_0 / (4 pi d^3) (3 (m_j.n) n - m_j)

    n is the unit vector from i to j, d the distance, and m the ``moment`` that another effect has set, held
    fixed. The force is not along n: it exerts a moment on the pair as a whole, which balances the torques T.
    The torques act on particles whose moments rotate with them (``permanent_moment``). Soft moments rotate
    inside the particle, which feels no torque. Moments along the field of all sources and moments
    (``mutual_induced_moment``) have none; for moments along the field of the sources alone, the balance is
    taken up by the sources. In a periodic box only the nearest image of a particle acts.

    Source: B16 Eqs (6.21), (6.23), L21 Eqs (4.8), (4.9).
    """

    fields = (MOMENT,)

    def turns(self, effects: Sequence[Effect]) -> bool:
        return any(isinstance(effect, PermanentMoment) for effect in effects)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {**super().connect(peers), "permanent": bool(peers.of(PermanentMoment))}

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return tuple(TruncatedDipoleDipole(cutoff=radii) for radii in CUTOFFS)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return self.between(s, w, i, j, separation, distance)

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        square, a, b = inverse * inverse, s.moment[w, i], (3.0 * mu_0 / (4.0 * ti.math.pi)) * s.moment[w, j]
        along_a, along_b = a.dot(separation), b.dot(separation)
        along = (5.0 * square) * (along_a * along_b) - a.dot(b)
        return inverse * (square * square) * (along * separation - along_a * b - along_b * a)

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        torque = 0.0 * separation
        if ti.static(self.permanent):
            torque = self.turn(s, w, i, j, separation, distance)
        return torque

    @ti.func
    def between(self, s, w, i, j, separation, distance):
        """Return the force on i by j, in N."""
        inverse = 1.0 / distance
        n, square = inverse * separation, inverse * inverse
        # In this order: in f32 the product of two moments of 1e-20 A m^2 underflows.
        a, b = s.moment[w, i], (3.0 * mu_0 / (4.0 * ti.math.pi) * square * square) * s.moment[w, j]
        along_a, along_b = a.dot(n), b.dot(n)
        return (5.0 * along_a * along_b - a.dot(b)) * n - along_a * b - along_b * a

    @ti.func
    def turn(self, s, w, i, j, separation, distance):
        """Return the torque on i by j, in N m."""
        return s.moment[w, i].cross(dipole_field(s.moment[w, j], separation, distance))


class TruncatedDipoleDipole(DipolePairs, DipoleDipole):
    """Magnetic moments within a cut-off attract, repel and rotate each other as dipoles; beyond it no force
    acts.

        d_c = cutoff (R_i + R_j)/2 + gap,    x = d/d_c,    f(x) = 1 plain, 1 - 4 x^3 + 3 x^4 shifted
        U = f U_dipoles,    F_i = f F_dipoles + f'(x) U_dipoles / d_c n,    T_i = f T_dipoles

    The law is otherwise the same as ``dipole_dipole``; pairs are found with the pair list. Without a shift
    the dipole force acts up to the cut-off and jumps there: at 30 radii by 2e-5 of the force at contact. With
    the shift, as in lj/sf/dipole/sf of LAMMPS, energy and force end smoothly and energy is conserved. Inside
    the cut-off they are then weaker than for dipoles: at half of d_c the energy is 5/16 lower.

    B16 uses 30 radii (section 6.3), because the energy of its strongest moments is below k T from about 20
    radii on (by its numbers, from 25). L21 uses a ``gap`` of 8 um between the surfaces of iron grains,
    ``cutoff`` 2, and three diameters for asteroids, ``cutoff`` 6 (section 4.2.1.2).

    Source: B16 Eqs (6.21), (6.23), section 6.3; L21 Eqs (4.8), (4.9); M. Orsi, D. Y. Haubertin, W. E.
    Sanderson, J. W. Essex, J. Phys. Chem. B 112 (2008) 802.
    """

    cutoff: float = parameter(
        "", "cut-off distance of the centres, over the mean radius of the pair", 30.0, ge=2
    )

    every_pair = False

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        beyond = self.cutoff - 2
        # Rounding may give a cut-off at contact, which is invalid, or one not below the cut-off of the law
        # itself.
        nearer = dict.fromkeys(
            (min(three_digits(2 + part * beyond), self.cutoff), three_digits(part * self.gap))
            for part in NEARER
        )
        return tuple(
            self.model_copy(update={"cutoff": cutoff, "gap": gap})
            for cutoff, gap in nearer
            if (cutoff > 2 or gap > 0) and (cutoff, gap) != (self.cutoff, self.gap)
        )

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        part, slope = self.part(s, w, i, j, distance)
        total = part * self.between(s, w, i, j, separation, distance)
        if ti.static(self.shifted):
            field = dipole_field(s.moment[w, j], separation, distance)
            total -= slope / distance * s.moment[w, i].dot(field) / distance * separation
        return total

    @ti.func
    def pair_torque(self, s, w, i, j, separation, distance, t):
        torque = 0.0 * separation
        if ti.static(self.permanent):
            part, _slope = self.part(s, w, i, j, distance)
            torque = part * self.turn(s, w, i, j, separation, distance)
        return torque
