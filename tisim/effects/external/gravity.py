"""Uniform gravity (L21 section 2.3)."""

from __future__ import annotations

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Force, parameter

STANDARD = 9.80665
"""Standard acceleration of free fall, m/s^2, exact by definition."""


class Gravity(Force):
    """Uniform gravity gives particles their weight, F = m g.

    Source: L21 section 2.3.
    """

    acceleration: Vector = parameter("m/s^2", "acceleration g of free fall", (0.0, 0.0, -STANDARD))

    @ti.func
    def force(self, s, w, i, t):
        return s.mass[w, i] * self.acceleration(w)
