"""The force of a non-uniform magnetic field on magnetic particles (Z16 Eq. 7.24)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, keeps_apart, parameter
from tisim.sources.base import sources
from tisim.state.bound import Peers


class MagneticBodyForce(Force):
    """A non-uniform magnetic field pulls particles towards stronger field, or weaker field for a negative
    gamma.

        F = grad(gamma B.B) = 2 gamma (grad B)^T B

    B is the sum of all sources. gamma is the same for all particles, regardless of their size; for a sphere
    of volume V and small susceptibility chi it is chi V / (2 mu_0). Uniform fields exert no force.

    Source: Z16 Eq. (7.24).
    """

    requires_source = ("magnetic_flux_density",)

    gamma: float = parameter("J/T^2", "magnetic parameter gamma of each particle", examples=[1e-6])

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Contacts are far stiffer.
        return math.inf if keeps_apart(effects) else None

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"applied": sources(peers, "magnetic_flux_density")}

    @ti.func
    def force(self, s, w, i, t):
        r = s.position[w, i]
        b, gradient = 0.0 * r, ti.Matrix.zero(s.real, 3, 3)
        for source in ti.static(self.applied):
            value, slope = source.value_and_gradient(w, r, t)
            b += value
            gradient += slope
        return 2.0 * self.gamma(w) * (gradient.transpose() @ b)
