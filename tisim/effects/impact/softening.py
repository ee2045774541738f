"""Thermal softening: hardness decreases with temperature (Z04 section 6)."""

from __future__ import annotations

from typing import ClassVar

from scipy.constants import R

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.impact.heating import Heating
from tisim.effects.impact.law import ImpactLaw
from tisim.numerics import elementary

LARGEST_EXPONENT = 50.0
"""Largest exponent: hardness is then 5e21 times H_0. No grains bond, and the value fits f32 for any H_0 of a
solid."""


class Softening(ImpactLaw):
    """The hardness of a grain decreases with its temperature.

        H = H_0 exp(Q / (R T)),    R the gas constant

    H_0 is the hardness of ``impact``, the limit at high temperature (the paper calls it the hardness at
    absolute zero, at which its formula is infinite).

    Source: Z04 section 6, text after Eq. (6.2).
    """

    fields = ("temperature",)
    requires: ClassVar = (Heating,)

    activation_energy: float = parameter("J/mol", "activation energy Q of softening", examples=[5e3], ge=0)

    @ti.func
    def hardness_factor(self, w, temperature):
        coldest = self.activation_energy(w) / (R * LARGEST_EXPONENT) + 1e-30
        return elementary.exp(self.activation_energy(w) / (R * ti.max(temperature, coldest)))
