"""Gravity between particles, summed over all pairs (L21 section 4.2.1.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.constants import G

from tisim.backend.taichi import ti
from tisim.components.component import parameter
from tisim.effects.base import Effect, PairForce
from tisim.effects.gravitation.tree_gravity import TreeGravity, fall_step

ROOT_G = G**0.5
"""The square root of the gravitational constant, N^(1/2) m/kg: m ROOT_G corresponds to a charge in Coulomb's
law."""
OPENING_ANGLES = (0.8, 0.5, 0.3)
"""Opening angles of a tree that are tried as approximations."""


class SelfGravity(PairForce):
    """Particles attract each other by gravity, over all pairs.

        F_i = G sum_j m_i m_j / d^2 n_ij

    n_ij is the unit vector from i to j, d the distance of the centres, and G the CODATA value. Spheres with
    radially symmetric density attract each other exactly as point masses do, as long as they do not overlap.
    Overlapping spheres are also treated as points, whose force diverges as d goes to 0. Grains in contact,
    which overlap by a small part of their radii, never come near this limit; for clouds of points without
    contacts use ``softened_self_gravity``. In a periodic box only the nearest image of a particle acts, which
    does not represent the gravity of an infinite medium.

    For thousands of particles ``tree_gravity`` is faster.

    Source: L21 section 4.2.1.3, after I. Newton.
    """

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        return tuple(TreeGravity(opening_angle=theta) for theta in OPENING_ANGLES)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        return fall_step(start)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return self.attraction(s, w, i, j, 1.0 / distance) * separation

    @ti.func
    def pair_force_by_inverse(self, s, w, i, j, separation, inverse, t):
        return self.attraction(s, w, i, j, inverse) * separation

    @ti.func
    def attraction(self, s, w, i, j, inverse):
        """Return the force between i and j over their distance (N/m), given the inverse distance (1/m)."""
        # Divide each mass by the distance first: in f32 products of two masses of 1e20 kg overflow, of 1e-20
        # kg underflow.
        a, b = ROOT_G * s.mass[w, i] * inverse, ROOT_G * s.mass[w, j] * inverse
        return a * b * inverse


class SoftenedSelfGravity(SelfGravity):
    """Particles attract each other by gravity that is softened at short distance, over all pairs.

        F_i = G sum_j m_i m_j d / (d^2 + eps^2)^(3/2) n_ij

    Each particle acts as a Plummer sphere of length eps. This limits scattering in close encounters, and two
    particles at one place exert no force. It is for clouds whose particles represent many bodies each; the
    gravity of grains with contacts needs no softening. Otherwise it is the same as ``self_gravity``.

    Source: H. C. Plummer, Mon. Not. R. Astron. Soc. 71 (1911) 460; S. J. Aarseth, Mon. Not. R. Astron. Soc.
    126 (1963) 223.
    """

    softening_length: float = parameter("m", "softening length eps", examples=[0.1], gt=0)

    def approximations(self, extent: float) -> tuple[Effect, ...]:
        soft = {"softening_length": self.softening_length}
        return tuple(TreeGravity(opening_angle=theta, **soft) for theta in OPENING_ANGLES)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        soft = self.softening_length(w)
        return self.attraction(s, w, i, j, 1.0 / ti.sqrt(distance * distance + soft * soft)) * separation
