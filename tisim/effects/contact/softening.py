"""Thermal softening of contact: stiffness falls with temperature (Z16 Eqs 7.18-7.20)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.power_law import Contact, ContactLaw
from tisim.numerics import elementary


class ContactSoftening(ContactLaw):
    """The contact stiffness of a grain decreases with its temperature.

        K_i = max(K_0 exp(-a (T_i / T* - 1)), K_lim)

    K_0 is the stiffness that ``contact`` gives. Below T* a grain is stiffer. Section 9 of the paper prints
    the exponent as (a T/T* - 1), the same only for its a = 1.

    Source: Z16 Eqs (7.18)-(7.20).
    """

    fields = ("temperature",)
    requires: ClassVar = (Contact,)

    sensitivity: float = parameter("", "thermal sensitivity a", examples=[1.0], ge=0)
    reference_temperature: float = parameter(
        "K", "reference temperature T*, at which the stiffness is K_0", examples=[300.0], gt=0
    )
    floor: float = parameter("N/m^2", "lower limit K_lim of the stiffness", 0.0, ge=0)

    def softened_stiffness(self, state: Mapping[str, np.ndarray], stiffness: np.ndarray) -> np.ndarray:
        excess = state["temperature"].astype(float) / self.reference_temperature - 1.0
        return np.maximum(stiffness * np.exp(-self.sensitivity * excess), self.floor)

    @ti.func
    def softened(self, s, w, i, stiffness):
        excess = s.temperature[w, i] / self.reference_temperature(w) - 1.0
        return ti.max(stiffness * elementary.exp(-self.sensitivity(w) * excess), self.floor(w))
