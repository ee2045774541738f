"""Hertz's contact of elastic spheres (Z16 Eq. B.7)."""

from __future__ import annotations

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.normal import NormalContact, overlap
from tisim.effects.contact.overlapping_pairs import OverlappingPairs


class Hertz(NormalContact):
    """Elastic spheres that overlap repel each other by Hertz's law.

        F_i = -4/3 sqrt(R*) E* delta^1.5 n_ij,    1/R* = 1/R_i + 1/R_j,    1/E* = 2 (1 - nu^2) / E

    delta is the overlap and n_ij the unit vector from i to j. All grains have the same material. The law is
    free of friction and loss, and assumes a contact circle that is small compared with the radii. The printed
    equation lacks the minus sign; the n_ij of the paper points from i to j.

    Source: Z16 Eq. (B.7), after Hertz (1882).
    """

    young: float = parameter("Pa", "Young's modulus E of the material", examples=[1e7], gt=0)
    poisson: float = parameter("", "Poisson's ratio nu of the material", examples=[0.25], gt=-1, le=0.5)

    def push(self, radius: float, overlap: np.ndarray) -> np.ndarray:
        return self._push(radius / 2, overlap)

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        return self._push(pairs.reduced_radius, pairs.overlap)

    def _push(self, reduced: float | np.ndarray, overlap: np.ndarray) -> np.ndarray:
        """Return the force (N), given R* (m) and overlaps (m)."""
        modulus = self.young / (2 * (1 - self.poisson**2))
        push: np.ndarray = 4 / 3 * modulus * np.sqrt(reduced) * overlap**1.5
        return push

    @ti.func
    def compression(self, s, w, i, j, distance):
        a, b = s.radius[w, i], s.radius[w, j]
        delta, effective = overlap(s, w, i, j, distance), a * b / (a + b)
        modulus = self.young(w) / (2.0 * (1.0 - self.poisson(w) ** 2))
        return 4.0 / 3.0 * modulus * ti.sqrt(effective * delta) * delta
