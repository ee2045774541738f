"""Contact of soft spheres by a power of their overlap strain (Z16 section 7.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, option, parameter
from tisim.effects.contact.normal import NormalContact, area, strain
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.numerics.elementary import Exponent, power
from tisim.state.bound import Peers


class ContactLaw(Effect):
    """This is the contract of an effect that changes the stiffness of contact."""

    contract: ClassVar[bool] = True

    @ti.func
    def softened(self, s, w, i, stiffness):
        """Return the stiffness (N/m^2) of grain i as it is now, given the stiffness of the material."""
        return stiffness

    def softened_stiffness(self, state: Mapping[str, np.ndarray], stiffness: np.ndarray) -> np.ndarray:
        """Return the same in NumPy for all grains of a state; infinity if a law does not define it."""
        return np.full(stiffness.shape, np.inf)


class Contact(NormalContact):
    """Soft spheres that overlap repel each other by a power of their overlap strain.

        F_i = -K_ij E^p A n_ij

    E is the overlap strain, A the contact area, n_ij the unit vector from i to j, and K_ij the mean stiffness
    of the two grains (7.20).

    Source: Z16 Eqs (7.3)-(7.7), (B.5).
    """

    stiffness: float = parameter("N/m^2", "stiffness K of the material", examples=[1e6], gt=0)
    exponent: Exponent = option("exponent p of the overlap strain; whole numbers are fastest", 2, gt=0)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"laws": peers.of(ContactLaw)}

    def push(self, radius: float, overlap: np.ndarray) -> np.ndarray:
        area = math.pi * overlap * (radius - 0.25 * overlap)
        push: np.ndarray = self.stiffness * (overlap / (2 * radius)) ** self.exponent * area
        return push

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        i, j, overlap = pairs.i, pairs.j, pairs.overlap
        radius = pairs.state["radius"].astype(float)
        stiffness = np.full(radius.shape, self.stiffness)
        for law in pairs.effects:
            if isinstance(law, ContactLaw):
                stiffness = law.softened_stiffness(pairs.state, stiffness)
        sizes, step = radius[i] + radius[j], radius[i] - radius[j]
        distance = sizes - overlap
        # The contact circle, B.5; there is none if a sphere is inside the other.
        apart = np.maximum(distance**2 - step**2, 0.0)
        area = np.pi / 4 * (distance + sizes) * overlap * apart / distance**2
        force: np.ndarray = 0.5 * (stiffness[i] + stiffness[j]) * (overlap / sizes) ** self.exponent * area
        return force

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
