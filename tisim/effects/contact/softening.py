"""Thermal softening of contact: stiffness falls with temperature (Z16 Eqs 7.18-7.20)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.contact.power_law import Contact, ContactLaw


class ContactSoftening(ContactLaw):
    """K_i = max(K_0 exp(-a (T_i / T* - 1)), K_lim); K_0 is the stiffness of the contact.

    sensitivity : a. reference_temperature : T*, at which K_i = K_0; below it a grain is stiffer.
    floor : K_lim, the least stiffness.

    Source: Z16 Eqs (7.18)-(7.20). Section 9 prints the exponent as (a T/T* - 1), the same only for its a = 1.
    """

    fields = ("temperature",)
    requires: ClassVar = (Contact,)

    sensitivity: float = parameter("", ge=0)
    reference_temperature: float = parameter("K", gt=0)
    floor: float = parameter("N/m^2", 0.0, ge=0)

    @ti.func
    def softened(self, s, w, i, stiffness):
        excess = s.temperature[w, i] / self.reference_temperature(w) - 1.0
        return ti.max(stiffness * ti.exp(-self.sensitivity(w) * excess), self.floor(w))
