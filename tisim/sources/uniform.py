"""Uniform electric and magnetic fields that may oscillate in time (Z13 section 2)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Effect
from tisim.numerics import elementary
from tisim.sources.base import parameter
from tisim.sources.switched import NO_END, Switched

STILL: Vector = (0.0, 0.0, 0.0)


class Uniform(Switched):
    """The contract of a field constant + amplitude sin(omega t + phase), each component by itself, between
    two times."""

    contract: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = True

    if TYPE_CHECKING:
        constant: Vector
        amplitude: Vector
        omega: Vector

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float:
        rates = [omega for omega, size in zip(self.omega, self.amplitude, strict=True) if size != 0]
        fastest = max(map(abs, rates), default=0.0)
        return 2 / fastest if fastest > 0 else math.inf

    def strongest(self) -> float:
        return math.hypot(*self.constant) + math.hypot(*self.amplitude)

    @ti.func
    def value(self, w, r, t):
        value = self.constant(w)
        # A field that does not oscillate is not slowed down by sines.
        if self.amplitude(w).norm_sqr() > 0.0:
            # In f64 for any precision, because omega t grows without bound.
            amplitude, angle = self.amplitude(w), self.omega(w) * t + self.phase(w)
            for k in ti.static(range(3)):
                value[k] += amplitude[k] * ti.cast(elementary.sin(angle[k]), float)
        return ti.select(self.acts(w, t), 1.0, 0.0) * value


class ElectricField(Uniform):
    """A uniform electric field is constant, oscillates, or both.

        E = E_0 + E_1 sin(omega t + phase),    each component by itself

    It is zero before ``begin`` and from ``end`` on; the phase still refers to t = 0.

    Source: Z13 Eqs (3)-(5), (16).
    """

    quantity = "electric_field"
    constant: Vector = parameter("V/m", "constant part E_0", STILL)
    amplitude: Vector = parameter("V/m", "amplitude E_1 of the oscillating part", STILL)
    omega: Vector = parameter("rad/s", "angular frequency omega of the oscillation", STILL)
    phase: Vector = parameter("rad", "phase of the oscillation at t = 0", STILL)
    begin: float = parameter("s", "time from which on the field acts", 0.0, ge=0)
    end: float = parameter("s", "time at which the field is switched off", NO_END, gt=0)


class MagneticField(Uniform):
    """A uniform magnetic flux density is constant, oscillates, or both.

        B = B_0 + B_1 sin(omega t + phase),    each component by itself

    It is zero before ``begin`` and from ``end`` on; the phase still refers to t = 0. The electric field
    induced by a changing B (Faraday's law) is neglected, as in the paper, in which B is constant.

    Source: Z13 Eqs (3)-(5).
    """

    quantity = "magnetic_flux_density"
    constant: Vector = parameter("T", "constant part B_0", STILL)
    amplitude: Vector = parameter("T", "amplitude B_1 of the oscillating part", STILL)
    omega: Vector = parameter("rad/s", "angular frequency omega of the oscillation", STILL)
    phase: Vector = parameter("rad", "phase of the oscillation at t = 0", STILL)
    begin: float = parameter("s", "time from which on the field acts", 0.0, ge=0)
    end: float = parameter("s", "time at which the field is switched off", NO_END, gt=0)
