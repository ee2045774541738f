"""Mie's potential: repulsion and attraction of spheres by powers of distance (B16 Eqs 6.18, 6.19)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, PairForce, option, parameter
from tisim.effects.base.critical_step import critical_step, impact_stiffness, smallest_grains
from tisim.errors import must
from tisim.numerics.elementary import Exponent, power


class Mie(PairForce):
    """Spheres repel and attract each other by Mie's potential within a cut-off; beyond it no force acts.

        F_i = -grad_i U,    U = C eps [(sigma/d)^n - (sigma/d)^m] + const,    sigma = R_i + R_j

    C = n/(n - m) (n/m)^(m/(n - m)) makes eps the depth of the well, at d = sigma (n/m)^(1/(n - m)). U is
    shifted to vanish at the cut-off, which changes no force. B16 represents hard spheres by exponents of 30
    and 15 (section 6.3), with eps = 100 k T and repulsion alone; 12 and 6 give the Lennard-Jones potential.
    The default cut-off is the bottom of the well, at which the force ends with a kink; at other cut-offs it
    jumps.

    Source: B16 Eqs (6.18), (6.19), after Mie (1903).
    """

    fields = ("radius",)
    short_ranged = True
    kinked: ClassVar[bool] = True

    epsilon: float = parameter("J", "depth eps of the potential well", examples=[4e-19], gt=0)
    n: Exponent = option("exponent n of the repulsion, above m; whole numbers are fastest", 30, gt=0)
    m: Exponent = option("exponent m of the attraction", 15, gt=0)
    cutoff: float | None = parameter(
        "", "cut-off distance over sigma; by default the bottom of the well", None, gt=0
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        must(self.n > self.m, "mie.n", f"greater than m, {self.m}", self.n)
        return self

    @property
    def prefactor(self) -> float:
        """Return the prefactor C of the law, which makes eps its depth."""
        return self.n / (self.n - self.m) * (self.n / self.m) ** (self.m / (self.n - self.m))

    def at_start(self, masses: np.ndarray) -> Self:
        bottom = (self.n / self.m) ** (1 / (self.n - self.m))
        return self if self.cutoff else self.model_copy(update={"cutoff": bottom})

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        shortest, cutoff = math.inf, self.at_start(start["mass"]).cutoff or 1.0
        for _, mass, radius in smallest_grains(start):
            sigma = 2 * radius

            def push(overlap: np.ndarray, sigma: float = sigma) -> np.ndarray:
                q = sigma / np.maximum(cutoff * sigma - overlap, 1e-3 * sigma)
                slope = self.n * q**self.n - self.m * q**self.m
                return np.asarray(self.prefactor * self.epsilon * slope * q / sigma)

            stiffness = impact_stiffness(push, 0.5 * mass, cutoff * sigma, speed)
            shortest = min(shortest, critical_step(stiffness, 0.5 * mass))
        return shortest

    @ti.func
    def reach(self, s, w, i):
        # Between the surfaces of two as large as i.
        return 2.0 * ti.max(self.cutoff(w) - 1.0, 0.0) * s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        total, sigma = 0.0 * separation, s.radius[w, i] + s.radius[w, j]
        if distance < self.cutoff(w) * sigma:
            inverse = 1.0 / distance
            q = sigma * inverse
            slope = self.n * power(q, self.n) - self.m * power(q, self.m)
            total = -self.prefactor * self.epsilon(w) * slope * inverse * (inverse * separation)
        return total
