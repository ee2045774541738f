"""How high each particle has risen: an observer, such as of a grain that rebounds."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.directed import Directed
from tisim.effects import Vector
from tisim.operators.base import Operator, parameter
from tisim.operators.peak_displacement import START_POSITION
from tisim.state.fields import Field


class PeakHeight(Directed, Operator):
    """The greatest height that each particle has had above where it began is observed; nothing is changed.

        h_i = max over steps of (r_i - r_i(0)) . n

    It is the field ``peak_height`` (m), 0 of a particle that has only gone down; n is the unit vector of the
    direction. r(0) is the field ``origin`` (m), the position at the start. A particle that begins at a plate
    with the speed of a fall has the height of its rebound, until a later bounce is higher. In a box with
    joined faces a particle that goes through one jumps, and its height with it.
    """

    fields: ClassVar = (START_POSITION, Field("peak_height", "m", 1, "keep"))

    direction: Vector = parameter("", "direction that is up", (0.0, 0.0, 1.0))

    @ti.func
    def particle(self, s, w, i, t, dt):
        rise = (s.position[w, i] - s.origin[w, i]).dot(self.axis(w))
        s.peak_height[w, i] = ti.max(s.peak_height[w, i], rise)
