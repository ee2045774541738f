"""Coulomb friction at impact (Z04 Eq. 4.17)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.impact.impact import Impact
from tisim.effects.impact.law import ImpactLaw


class Friction(ImpactLaw):
    """Coulomb friction reduces the slip of two grains in an impact, or stops it.

        tangential impulse = min(mu |I_n| dtau, impulse that stops the slip)

    |I_n| dtau is the normal impulse. Grains do not rotate (Z04 section 2). Z04 gives no bound for sticking,
    without which friction could reverse the slip.

    Source: Z04 Eq. (4.17).
    """

    requires: ClassVar = (Impact,)

    coefficient: float = parameter("", "coefficient of friction mu", examples=[0.1], ge=0)

    @ti.func
    def limit(self, w, impulse):
        return self.coefficient(w) * impulse
