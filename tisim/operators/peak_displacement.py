"""The largest displacement of a cloud's centre of gravity from its start: an observer."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.operators.base import Operator
from tisim.state.fields import Field, WorldField

START_POSITION = Field("origin", "m", 3, "mean", default="position")
"""The position of a particle at the start."""


class PeakDisplacement(Operator):
    """The largest displacement of the centre of gravity is recorded; the motion is not changed.

        max over steps of |sum_i m_i (r_i - r_i(0))| / sum_i m_i

    It is ``measures["peak_displacement"]`` (m). r(0) is the field ``origin`` (m), the position at the start.
    Particles that do not interact then take common steps. In a periodic box, distances are computed as in
    open space.
    """

    fields: ClassVar = (START_POSITION,)
    world_fields: ClassVar = (WorldField("peak_displacement", "measure", "m"),)
    terms: ClassVar = 4

    @ti.func
    def each(self, s, w, i):
        mass, shift = s.mass[w, i], s.position[w, i] - s.origin[w, i]
        return ti.cast(ti.Vector([mass * shift[0], mass * shift[1], mass * shift[2], mass]), ti.f64)

    @ti.func
    def world(self, s, w):
        total, farthest = self.sums.total(w), ti.cast(0.0, ti.f64)
        if total[3] > 0.0:
            farthest = ti.Vector([total[0], total[1], total[2]]).norm() / total[3]
        # A maximum with NaN would ignore the NaN.
        if not finite(farthest):
            s.fail_world_by_effect(w, self.index)
        s.peak_displacement[w] = ti.max(s.peak_displacement[w], farthest)
