"""Electric and magnetic fields that are the same everywhere and oscillate in time (Z13 section 2)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.sources.base import Source, parameter

STILL: Vector = (0.0, 0.0, 0.0)


class Uniform(Source):
    """constant + amplitude sin(omega t + phase), each component by itself; its gradient is zero."""

    contract: ClassVar[bool] = True

    @ti.func
    def value(self, w, r, t):
        value = self.constant(w)
        # A field that does not oscillate need not pay for sines.
        if self.amplitude(w).norm_sqr() > 0.0:
            # In f64, whatever the precision: omega t grows without bound.
            value += self.amplitude(w) * ti.cast(ti.sin(self.omega(w) * t + self.phase(w)), float)
        return value


class ElectricField(Uniform):
    """Uniform electric field E = E_0 + E_1 sin(omega t + phase), per component.

    constant, amplitude : E_0, E_1, V/m (the same as N/C). omega : angular frequency. phase : at t = 0.
    Source: Z13 Eqs (3)-(5), (16).
    """

    quantity = "electric_field"
    constant: Vector = parameter("V/m", STILL)
    amplitude: Vector = parameter("V/m", STILL)
    omega: Vector = parameter("rad/s", STILL)
    phase: Vector = parameter("rad", STILL)


class MagneticField(Uniform):
    """Uniform magnetic flux density B = B_0 + B_1 sin(omega t + phase), per component.

    constant, amplitude : B_0, B_1, T. omega : angular frequency. phase : at t = 0. The electric field that
    goes with a changing B (Faraday's law) is left out, as in the paper, where B is constant.
    Source: Z13 Eqs (3)-(5).
    """

    quantity = "magnetic_flux_density"
    constant: Vector = parameter("T", STILL)
    amplitude: Vector = parameter("T", STILL)
    omega: Vector = parameter("rad/s", STILL)
    phase: Vector = parameter("rad", STILL)
