"""Hertz's contact of elastic spheres (Z16 Eq. B.7)."""

from __future__ import annotations

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.normal import NormalContact, overlap


class Hertz(NormalContact):
    """F_i = -4/3 sqrt(R*) E* delta^1.5 n_ij; 1/R* = 1/R_i + 1/R_j, 1/E* = 2 (1 - nu^2) / E.

    young : E, Young's modulus. poisson : nu, Poisson's ratio. All grains are of one material.
    Frictionless, elastic, and for a circle of contact small beside the radii.

    Source: Z16 Eq. (B.7), after Hertz (1882). The minus sign is missing as printed; its n_ij is from i to j.
    """

    young: float = parameter("Pa", gt=0)
    poisson: float = parameter("", gt=-1, le=0.5)

    @ti.func
    def compression(self, s, w, i, j, distance):
        a, b = s.radius[w, i], s.radius[w, j]
        delta, effective = overlap(s, w, i, j, distance), a * b / (a + b)
        modulus = self.young(w) / (2.0 * (1.0 - self.poisson(w) ** 2))
        return 4.0 / 3.0 * modulus * ti.sqrt(effective * delta) * delta
