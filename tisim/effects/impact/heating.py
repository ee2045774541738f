"""Heat of impact: kinetic energy lost, and the work of deformation (Z04 Eqs 4.7-4.9, 6.8-6.10)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.impact.impact import Impact
from tisim.effects.impact.law import ImpactLaw
from tisim.state.fields import Field


class Heating(ImpactLaw):
    """The energy that a grain receives in impacts raises its temperature, which is uniform in the grain.

        dT = dE / (m C)

    Source: Z04 Eqs (6.5)-(6.8).
    """

    fields = ("temperature",)
    requires: ClassVar = (Impact,)

    heat_capacity: float = parameter(
        "J/(kg K)", "specific heat capacity C of the grains", examples=[1e3], gt=0
    )

    @ti.func
    def temperature(self, s, w, i, energy):
        return s.temperature[w, i] + energy / (s.mass[w, i] * self.heat_capacity(w))


class DeformationWork(ImpactLaw):
    """Each grain receives the work of deformation in an impact as heat.

        dW = m_ij v_n^2 (1 - e^2) / 3

    With the linear force and velocity histories of (4.4)-(4.6), the integral (4.7)-(4.9) of |I_n| over the
    relative approach is I* v_n (dtau_1 - e dtau_2) / 6, I* = 2 |I_n|. It is two thirds of the lost kinetic
    energy, which (6.10) also counts, and both grains receive it. The model of the paper therefore creates
    energy. This energy is recorded as ``deformation_work``. A scene without this effect conserves energy
    without the record.

    Source: Z04 Eqs (4.7)-(4.9), (6.10).
    """

    fields = ("temperature", Field("deformation_work", "J", 1, "sum"))
    requires: ClassVar = (Heating,)

    @ti.func
    def supply(self, w, area, work):
        return work

    @ti.func
    def book(self, s, w, i, energy):
        s.deformation_work[w, i] = s.deformation_work[w, i] + energy
