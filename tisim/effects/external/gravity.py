"""Uniform gravity (L21 section 2.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.constants import g

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Effect, Force, parameter


class Gravity(Force):
    """Uniform gravity gives particles their weight, F = m g.

    Source: L21 section 2.3.
    """

    homogeneous: ClassVar[bool] = True
    guards_steps: ClassVar[bool] = True

    acceleration: Vector = parameter("m/s^2", "acceleration g of free fall", (0.0, 0.0, -g))

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        return math.inf

    def reached_speed(self, duration: float, extent: float) -> float:
        size = math.hypot(*self.acceleration)
        return min(size * duration, math.sqrt(2 * size * extent))

    @ti.func
    def force(self, s, w, i, t):
        return s.mass[w, i] * self.acceleration(w)
