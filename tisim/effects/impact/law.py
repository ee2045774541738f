"""The contract of what takes part in an impact: what heats, softens, rubs, breaks or bonds grains."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect


class ImpactLaw(Effect):
    """The contract of an effect that contributes to an impact; each hook does nothing by default."""

    contract: ClassVar[bool] = True

    @ti.func
    def hardness_factor(self, w, temperature):
        """Factor on the hardness at this temperature (K)."""
        return 1.0

    @ti.func
    def limit(self, w, impulse):
        """Largest tangential impulse (N s) that goes with this normal impulse."""
        return 0.0 * impulse

    @ti.func
    def supply(self, w, area, work):
        """Energy (J) given to each grain: ``area`` of contact (m^2), ``work`` of deformation (J)."""
        return 0.0 * area

    @ti.func
    def book(self, s, w, i, energy):
        """Enter in the books of grain i what ``supply`` has given it. J."""

    @ti.func
    def temperature(self, s, w, i, energy):
        """Temperature (K) of grain i with this much energy (J) more."""
        return s.mass[w, i] * energy

    @ti.func
    def fracture(self, s, w, i, absorbed):
        """Whether grain i breaks, having absorbed this much kinetic energy (J); spends what it takes."""
        return 0

    @ti.func
    def bond(self, s, w, i, j, separation):
        """Join two grains that have bonded and have not broken."""


HOOKS = ("hardness_factor", "limit", "supply", "temperature", "fracture", "bond")
"""The hooks that an impact calls by itself; ``book`` goes with ``supply``."""
