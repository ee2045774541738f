"""The normal force of a linear spring."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import NormalForce, Overlap
from tisim.materials.materials import Touching


class Hooke(NormalForce):
    """Grains repel each other by a linear spring.

        F_n = k delta,    S_n = k

    With light damping an impact lasts pi sqrt(m* / k), at any speed.

    Source: P. A. Cundall and O. D. L. Strack, Geotechnique 29 (1979) 47.
    """

    uses: ClassVar = ("stiffness",)
    softening: ClassVar = {"stiffness": 0.5}

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"constant": pair.mixed("stiffness")}

    def push(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        return pair.mixed("stiffness") * overlap

    @ti.func
    def stiffness(self, w, pair, circle):
        return self.constant(w, pair) + 0.0 * circle

    @ti.func
    def elastic(self, w, pair, radius, overlap, circle):
        return self.constant(w, pair) * overlap
