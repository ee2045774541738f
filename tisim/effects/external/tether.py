"""A binder that ties each particle to its initial position (Z13 Eqs 11 and 34)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects.base import Effect, Force, parameter
from tisim.state.fields import Field


class Tether(Force):
    """A binder ties each particle to its initial position by a spring along each axis.

        F = -k (r - r(0)),    each component separately

    r(0) is the field ``anchor`` (m): by default the position at the start. In a box with joined faces the
    distance is not wrapped: a particle that leaves through a face is pulled back across the box, so tethered
    particles must stay clear of the faces. The minus sign is missing in (34) as printed; (11) has it.

    Source: Z13 Eqs (11), (34).
    """

    fields = (Field("anchor", "m", 3, "mean", default="position"),)

    stiffness: Vector = parameter(
        "N/m",
        "stiffness k of the binder along each axis; 0 leaves that direction free",
        examples=[(0.5, 0.5, 0.5)],
    )

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        stiffest = max(self.stiffness)
        lightest = float(start["mass"].min(initial=math.inf))
        return 2 * math.sqrt(lightest / stiffest) if stiffest > 0 else math.inf

    @ti.func
    def force(self, s, w, i, t):
        return -self.stiffness(w) * (s.position[w, i] - s.anchor[w, i])
