"""Forces of magnetic moments on each other (B16 Eqs 6.21 to 6.23, L21 Eqs 4.6 to 4.8)."""

from __future__ import annotations

from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, PairForce, parameter
from tisim.effects.magnetic.moment import MOMENT

CUTOFFS = (10.0, 20.0, 30.0, 60.0)
"""These cut-offs, in radii, are worth a try."""


class DipoleDipole(PairForce):
    """Magnetic moments attract and repel each other as dipoles, over all pairs.

        F_i = -grad_i U,    U = -mu_0 / (4 pi) (3 (m_i.n)(m_j.n) - m_i.m_j) / d^3
            = -3 mu_0 / (4 pi d^4) [(m_i.n) m_j + (m_j.n) m_i + (m_i.m_j) n - 5 (m_i.n)(m_j.n) n]

    n is the unit vector from i to j, d the distance, m the ``moment`` of each that another effect has set,
    held fixed. The force is not along n: it turns the pair as a whole, against the torques m x B of the
    fields on the moments. These are not given to the particles, as moments turn inside them; where they lie
    along the field of all sources and moments (``mutual_induced_moment``) there are none, and where they lie
    along that of the sources alone, the sources take the balance up. In a periodic box only the nearest image
    of a particle acts.

    Source: B16 Eqs (6.21), (6.23).
    """

    fields = (MOMENT,)

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
    def between(self, s, w, i, j, separation, distance):
        """Return the force on i by j, in N."""
        inverse = 1.0 / distance
        n, square = inverse * separation, inverse * inverse
        # In this order: in f32 the product of two moments of 1e-20 A m^2 is nothing.
        a, b = s.moment[w, i], (3.0 * mu_0 / (4.0 * ti.math.pi) * square * square) * s.moment[w, j]
        along_a, along_b = a.dot(n), b.dot(n)
        return (5.0 * along_a * along_b - a.dot(b)) * n - along_a * b - along_b * a


class TruncatedDipoleDipole(DipoleDipole):
    """Magnetic moments within a cut-off attract and repel each other as dipoles; beyond it there is no force.

    The law is that of ``dipole_dipole``; pairs are found with the pair list. The force is not shifted: at 30
    radii it jumps by 2e-5 of that at contact. B16 takes 30 (section 6.3), as the energy of the strongest
    moments it has is less than k T from about 20 radii on (by its numbers, from 25).

    Source: B16 Eqs (6.21), (6.23), section 6.3.
    """

    short_ranged = True

    cutoff: float = parameter(
        "", "cut-off distance of the centres, over the mean radius of the two", 30.0, gt=2
    )

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return ()

    @ti.func
    def reach(self, s, w, i):
        # Between surfaces, of two as large as i: (cutoff / 2 - 1) (R_i + R_j).
        return (self.cutoff(w) - 2.0) * s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total = 0.0 * separation
        if 2.0 * distance <= self.cutoff(w) * (s.radius[w, i] + s.radius[w, j]):
            total = self.between(s, w, i, j, separation, distance)
        return total
