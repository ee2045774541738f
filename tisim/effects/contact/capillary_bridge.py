"""Liquid bridges between grains, and between grains and walls."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, keeps_apart, parameter
from tisim.effects.contact.granular.contact import GranularContact
from tisim.effects.contact.overlapping_pairs import OverlappingPairs


class CapillaryBridge(GranularContact):
    """Grains that have touched attract each other through a liquid bridge until it ruptures.

        F = 2 pi R gamma cos(theta) / (1 + 1.05 s + 2.5 s^2),    s = S sqrt(R / V)

    S is the gap between the surfaces, 0 while they overlap, and R = 2 R_i R_j / (R_i + R_j). A bridge of
    volume V forms when surfaces touch, and ruptures when S exceeds (1 + theta / 2) V^(1/3). The contact angle
    is the same on both grains. The fit holds for V of at most some thousandths of R^3, and for grains so
    small that gravity does not deform the liquid. The force acts together with a contact law that pushes
    grains apart, such as ``granular``.

    Source: C. D. Willett, M. J. Adams, S. A. Johnson and J. P. K. Seville, Langmuir 16 (2000) 9396, Eq. (12);
    G. Lian, C. Thornton and M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138, for the rupture.
    """

    memory: ClassVar[int] = 1

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # The force changes with distance far more slowly than a contact force.
        return math.inf if keeps_apart(effects) else None

    depends_on_velocity: ClassVar[bool] = False

    surface_tension: float = parameter("N/m", "surface tension gamma", examples=[0.072], ge=0)
    contact_angle: float = parameter("rad", "contact angle theta", 0.0, ge=0, lt=math.pi / 2)
    volume: float = parameter("m^3", "volume V of a bridge", examples=[1e-12], gt=0)

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield from (("line", 1), ("rupture", 1))

    def values(self) -> list[float]:
        line = 2 * math.pi * self.surface_tension * math.cos(self.contact_angle)
        return [*super().values(), line, (1 + self.contact_angle / 2) * self.volume ** (1 / 3)]

    def normal_force(self, pairs: OverlappingPairs) -> np.ndarray:
        line = 2 * math.pi * self.surface_tension * math.cos(self.contact_angle)
        return -line * 2 * pairs.reduced_radius

    @ti.func
    def reach(self, s, w, i):
        return self.rupture(w)

    @ti.func
    def wall_reach(self, s, w, i):
        return self.rupture(w)

    @ti.func
    def lasts(self, w, pair, overlap, radius, past):
        return (overlap >= 0.0) | ((past[0] > 0.0) & (overlap >= -self.rupture(w)))

    @ti.func
    def contact(self, w, pair, normal, overlap, radius, mass, inverses, slip, spinning, tilt, turn, past, dt):
        mean = 2.0 * radius
        gap = ti.max(-overlap, 0.0) * ti.sqrt(mean / self.volume(w))
        pull = self.line(w) * mean / (1.0 + gap * (1.05 + 2.5 * gap))
        return pull * normal, 0.0 * normal, 0.0 * past + 1.0
