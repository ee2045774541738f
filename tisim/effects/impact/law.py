"""The contract of effects that take part in an impact by heating, softening, friction, fracture or
bonding."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect


class ImpactLaw(Effect):
    """This is the contract of an effect that contributes to an impact; each hook does nothing by default."""

    contract: ClassVar[bool] = True

    @ti.func
    def hardness_factor(self, w, temperature):
        """Return the factor on the hardness at this temperature (K)."""
        return 1.0

    @ti.func
    def limit(self, w, impulse):
        """Return the largest tangential impulse (N s) for this normal impulse (N s)."""
        return 0.0 * impulse

    @ti.func
    def supply(self, w, area, work):
        """Return the energy (J) given to each grain; ``area`` is the contact area (m^2), ``work`` the work of
        deformation (J)."""
        return 0.0 * area

    @ti.func
    def book(self, s, w, i, energy):
        """Record for grain i the energy (J) that ``supply`` has given it."""

    @ti.func
    def temperature(self, s, w, i, energy):
        """Return the temperature (K) of grain i after it has received this energy (J)."""
        return s.mass[w, i] * energy

    @ti.func
    def fracture(self, s, w, i, absorbed):
        """Return whether grain i breaks after absorbing this kinetic energy (J); consume the energy of
        fracture."""
        return 0

    @ti.func
    def bond(self, s, w, i, j, separation):
        """Join two grains that have bonded and have not broken."""


HOOKS = ("hardness_factor", "limit", "supply", "temperature", "fracture", "bond")
"""These hooks are called by an impact itself; ``book`` goes with ``supply``."""
