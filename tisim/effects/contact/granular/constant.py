"""Damping by a constant."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.parts import Damping
from tisim.materials.materials import Touching


class ConstantDamping(Damping):
    """Damping in proportion to the velocity alone.

        gamma is the same whatever the masses and the overlap

    Source: P. A. Cundall and O. D. L. Strack, Geotechnique 29 (1979) 47.
    """

    uses: ClassVar = ("damping",)

    def mix(self, pair: Touching) -> dict[str, float]:
        return {"constant": pair.mixed("damping")}

    @ti.func
    def coefficient(self, w, pair, stiffness, mass, factor):
        return self.constant(w, pair) + 0.0 * stiffness
