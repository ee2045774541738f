"""The largest height that each particle has reached: an observer, for example for a grain that rebounds."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.components.directed import Directed
from tisim.effects import Vector
from tisim.operators.base import Operator, parameter
from tisim.operators.peak_displacement import START_POSITION
from tisim.state.fields import Field


class PeakHeight(Directed, Operator):
    """The largest height of each particle above its start is recorded; the motion is not changed.

        h_i = max over steps of (r_i - r_i(0)) . n

    It is the field ``peak_height`` (m), 0 for a particle that has only gone down. n is the unit vector of the
    direction. r(0) is the field ``origin`` (m), the position at the start. For a particle that starts at a
    plate with the speed of a fall, it is the height of the rebound, unless a later bounce is higher. In a
    periodic box a particle that crosses a face jumps, and so does its height.
    """

    fields: ClassVar = (START_POSITION, Field("peak_height", "m", 1, "keep"))

    direction: Vector = parameter("", "upward direction", (0.0, 0.0, 1.0))

    @ti.func
    def particle(self, s, w, i, t, dt):
        rise = (s.position[w, i] - s.origin[w, i]).dot(self.axis(w))
        s.peak_height[w, i] = ti.max(s.peak_height[w, i], rise)
