"""Coulomb friction at impact (Z04 Eq. 4.17)."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import parameter
from tisim.effects.impact.impact import Impact, ImpactLaw


class Friction(ImpactLaw):
    """Slip is slowed by a tangential impulse mu |I_n| dtau, or stopped where that is more than it takes.

    coefficient : mu. Grains do not rotate (Z04 section 2). Z04 prints no bound at sticking, without which
    friction could reverse the slip.
    """

    requires: ClassVar = (Impact,)

    coefficient: float = parameter("", ge=0)

    @ti.func
    def limit(self, w, impulse):
        return self.coefficient(w) * impulse
