"""Contact of soft spheres by a power of their overlap strain (Z16 section 7.1)."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field as Option

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, parameter
from tisim.effects.contact.normal import NormalContact, area, strain
from tisim.numerics.powers import Exponent, power


class ContactLaw(Effect):
    """What an effect may contribute to the stiffness of contact; nothing unless overridden."""

    contract: ClassVar[bool] = True

    @ti.func
    def softened(self, s, w, i, stiffness):
        """Stiffness of grain i as it is now, given that of the material (N/m^2)."""
        return stiffness


class Contact(NormalContact):
    """F_i = -K E^p A n_ij, with E the overlap strain, A the contact area.

    stiffness : K, of the material; K_ij is the mean of what the two grains have (7.20).
    exponent : p, the same in all worlds of a batch: compiled in, so that a whole one costs products, no pow.
    Source: Z16 Eqs (7.3)-(7.7), (B.5).
    """

    stiffness: float = parameter("N/m^2", gt=0)
    exponent: Exponent = Option(2, gt=0)

    def connect(self, peers: tuple[Any, ...]) -> dict[str, Any]:
        return {"laws": tuple(peer for peer in peers if isinstance(peer, ContactLaw))}

    @ti.func
    def stiffness_of(self, s, w, i):
        stiffness = self.stiffness(w)
        for law in ti.static(self.laws):
            stiffness = law.softened(s, w, i, stiffness)
        return stiffness

    @ti.func
    def compression(self, s, w, i, j, distance):
        stiffness = 0.5 * (self.stiffness_of(s, w, i) + self.stiffness_of(s, w, j))
        return stiffness * power(strain(s, w, i, j, distance), self.exponent) * area(s, w, i, j, distance)
