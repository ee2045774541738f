"""The normal force of Hertz."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import NormalForce, Overlap
from tisim.materials.materials import Touching


class HertzMaterial(NormalForce):
    """Elastic spheres repel each other by Hertz's law, with the elastic constants of their materials.

        F_n = 4/3 E* a delta,    S_n = 2 E* a,    a^2 = R* delta

    Source: H. Hertz (1882).
    """

    uses: ClassVar = ("young", "poisson")
    softening: ClassVar = {"young": 0.4}
    restitution_factor: ClassVar[float] = math.sqrt(5 / 6)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"modulus": 2 * pair.effective_young}

    def push(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        push: Any = 4 / 3 * pair.effective_young * (radius * overlap) ** 0.5 * overlap
        return push

    @ti.func
    def stiffness(self, w, pair, circle):
        return self.modulus(w, pair) * circle

    @ti.func
    def elastic(self, w, pair, radius, overlap, circle):
        return 2.0 / 3.0 * self.modulus(w, pair) * circle * overlap
