"""The mean force on each particle over time: an observer."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.operators.base import Operator, parameter
from tisim.state.fields import Field


class MeanForce(Operator):
    """The mean over time of the force on each particle is recorded; the motion is not changed.

        mean_force = 1/(t - t_0) sum over steps of F dt

    t_0 is ``begin``, from which on dt counts, and t is the time. F is the sum of all forces as known when the
    step was taken; forces on particles that are held or move as prescribed are included. The result is the
    field ``mean_force`` (N), 0 up to t_0. The load on a wall of grains in steady flow is its sum over the
    grains of the wall.
    """

    fields: ClassVar = (Field("mean_force", "N", 3, "keep", double=True),)

    begin: float = parameter("s", "time t_0 from which on the mean is taken", 0.0, ge=0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        if ti.static(hasattr(s, "force")):
            step = ti.cast(dt, ti.f64)
            lasts = t - ti.cast(self.begin(w), ti.f64)
            # Only the part after begin counts for the step in which the mean begins, and nothing for earlier
            # steps.
            part = ti.select(lasts > 0.0, step / ti.max(lasts, step), 0.0)
            s.mean_force[w, i] += part * (ti.cast(s.force[w, i], ti.f64) - s.mean_force[w, i])
