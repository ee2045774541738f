"""Heat of the reaction of adsorbed gas squeezed between two grains (Z04 Eq. 6.9)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.impact.heating import Heating
from tisim.effects.impact.law import ImpactLaw
from tisim.state.fields import Field


class Reaction(ImpactLaw):
    """Gas adsorbed on the grains reacts in an impact and heats both grains.

        dH = alpha a,    a the contact area

    Source: Z04 Eq. (6.9).
    """

    fields = ("temperature", Field("reaction_heat", "J", 1, "sum"))
    requires: ClassVar = (Heating,)

    energy_density: float = parameter(
        "J/m^2", "energy alpha that the reaction releases per contact area", examples=[10.0], ge=0
    )

    @ti.func
    def supply(self, w, area, work):
        return self.energy_density(w) * area

    @ti.func
    def book(self, s, w, i, energy):
        s.reaction_heat[w, i] = s.reaction_heat[w, i] + energy
