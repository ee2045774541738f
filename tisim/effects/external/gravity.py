"""Uniform gravity (L21 section 2.3)."""

from __future__ import annotations

from typing import ClassVar

from scipy.constants import g

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Force, parameter


class Gravity(Force):
    """Uniform gravity gives particles their weight, F = m g.

    Source: L21 section 2.3.
    """

    homogeneous: ClassVar[bool] = True

    acceleration: Vector = parameter("m/s^2", "acceleration g of free fall", (0.0, 0.0, -g))

    @ti.func
    def force(self, s, w, i, t):
        return s.mass[w, i] * self.acceleration(w)
