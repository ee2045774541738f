"""Outflow: grains that leave through a plane are taken out and weighed."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.constraint.rigid_clumps import RigidClumps
from tisim.geometry.plane import Plane
from tisim.operators.base import Operator, option


class Outflow(Operator):
    """Grains whose centres are behind a plane, the side that its normal points away from, are taken out.

    ``work["outflow"]`` counts them and ``measures["outflow_mass"]`` is their mass (kg). How either grows is
    the discharge rate: record it with ``MeasureSeries``, and see ``tisim.analysis.discharge_rate``.
    """

    fields = ("radius",)
    any_order: ClassVar[bool] = True
    counters = ("outflow",)
    world_quantities = ("outflow_mass",)
    flags: ClassVar = ("outflow_due",)
    excludes: ClassVar = (RigidClumps,)

    planes: tuple[Plane, ...] = option("planes behind which grains are taken out", min_length=1)

    def measured(self) -> dict[str, str]:
        return {"outflow_mass": "kg"}

    @ti.func
    def particle(self, s, w, i, t, dt):
        if self.is_behind(w, s.position[w, i]):
            ti.atomic_max(s.outflow_due[w], 1)

    @ti.func
    def acts(self, s, w):
        return s.outflow_due[w]

    @ti.func
    def world(self, s, w):
        s.outflow_due[w] = 0
        for i in range(s.count[w]):
            if self.is_behind(w, s.position[w, i]):
                s.outflow[w] += 1
                s.outflow_mass[w] += ti.cast(s.mass[w, i], ti.f64)
                s.remove(w, i)

    @ti.func
    def is_behind(self, w, r):
        """Return whether a point (m) is behind one of the planes."""
        behind = 0
        for k in range(self.planes.size(w)):
            if self.planes.distance(w, k, r) < 0.0:
                behind = 1
        return behind
