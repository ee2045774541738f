"""Morse's potential: repulsion and attraction of spheres by exponentials of distance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, PairForce, parameter
from tisim.effects.base.critical_step import critical_step, smallest_grains
from tisim.numerics import elementary


class Morse(PairForce):
    """Spheres repel and attract each other by Morse's potential within a cut-off; beyond it no force acts.

        F_i = -grad_i U,    U = D [exp(-2 a (d - r_0)) - 2 exp(-a (d - r_0))] + const,    r_0 = R_i + R_j

    D is the depth of the well, at the distance r_0 at which the spheres touch. U is shifted to vanish at the
    cut-off, which changes no force; the force jumps there, unless the cut-off is the bottom of the well, at
    which it ends with a kink. Unlike Mie's, this repulsion is finite at any distance: spheres whose energy
    exceeds U(0) pass through each other.

    Source: P. M. Morse, Phys. Rev. 34 (1929) 57; Z13 names it after Eq. (24) and does not use it.
    """

    fields = ("radius",)
    short_ranged = True
    kinked: ClassVar[bool] = True

    depth: float = parameter("J", "depth D of the potential well", examples=[4e-19], gt=0)
    alpha: float = parameter("1/m", "inverse a of the decay length", examples=[1e4], gt=0)
    cutoff: float = parameter("", "cut-off distance over r_0", examples=[2.0], gt=0)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        shortest = math.inf
        for _, mass, radius in smallest_grains(start):
            stiffness = self.largest_stiffness(0.5 * mass, 2 * radius, speed)
            shortest = min(shortest, critical_step(stiffness, 0.5 * mass))
        return shortest

    def largest_stiffness(self, mass: float, touch: float, speed: float) -> float:
        """Return the largest second derivative (N/m) of the potential in a head-on collision.

        mass : reduced mass, kg. touch : r_0, m. speed : at the cut-off, m/s.

        With e = exp(-a (d - r_0)) it is U'' = 2 a^2 D e (2 e - 1). It grows up to the closest approach, at
        which e = 1 + ((1 - e_c)^2 + m* v^2 / (2 D))^(1/2) by conservation of energy, with e_c at the cut-off;
        or up to d = 0.
        """
        # Beyond this exponent a collision at any speed ends before d = 0, and exp would overflow.
        most = min(self.alpha * touch, 300.0)
        at_cutoff = math.exp(min(self.alpha * touch * (1 - self.cutoff), most))
        nearest = min(
            1 + math.sqrt((1 - at_cutoff) ** 2 + 0.5 * mass * speed**2 / self.depth), math.exp(most)
        )
        return 2 * self.alpha**2 * self.depth * nearest * (2 * nearest - 1)

    @ti.func
    def reach(self, s, w, i):
        # Between the surfaces of two as large as i.
        return 2.0 * ti.max(self.cutoff(w) - 1.0, 0.0) * s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total, touch = 0.0 * separation, s.radius[w, i] + s.radius[w, j]
        if distance < self.cutoff(w) * touch:
            e = elementary.exp(self.alpha(w) * (touch - distance))
            total = 2.0 * self.alpha(w) * self.depth(w) * e * (1.0 - e) / distance * separation
        return total
