"""Outflow: grains that leave through a plane are taken out and weighed."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint
from tisim.geometry.plane import Plane
from tisim.operators.base import Operator, option
from tisim.worlds.bound import Peers


class Outflow(Operator):
    """Grains whose centres are behind a plane, the side that its normal points away from, are taken out.

    A rigid clump is taken out as a whole, when its centre of mass is behind it.
    ``work["outflow"]`` counts them, a clump as one, and ``measures["outflow_mass"]`` is their mass (kg). How
    either grows is the discharge rate: record it with ``MeasureSeries``, and see
    ``tisim.analysis.discharge_rate``.
    """

    fields = ("radius",)
    any_order: ClassVar[bool] = True
    counters = ("outflow",)
    world_quantities = ("outflow_mass",)
    flags: ClassVar = ("outflow_due",)

    planes: tuple[Plane, ...] = option("planes behind which grains are taken out", min_length=1)

    def measured(self) -> dict[str, str]:
        return {"outflow_mass": "kg"}

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"constraints": peers.of(Constraint)}

    @ti.func
    def particle(self, s, w, i, t, dt):
        if self.has_left(s, w, i):
            ti.atomic_max(s.outflow_due[w], 1)

    @ti.func
    def acts(self, s, w):
        return s.outflow_due[w]

    @ti.func
    def world(self, s, w):
        s.outflow_due[w] = 0
        for i in range(s.count[w]):
            if self.has_left(s, w, i):
                s.outflow[w] += self.counts(s, w, i)
                s.outflow_mass[w] += ti.cast(s.mass[w, i], ti.f64)
                s.remove(w, i)

    @ti.func
    def has_left(self, s, w, i):
        """Return whether particle i is to be taken out."""
        place = s.position[w, i]
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                place = constraint.home(s, w, i)
        return self.is_behind(w, place)

    @ti.func
    def counts(self, s, w, i):
        """Return 1 for a particle that stands for a grain, 0 for another of its clump."""
        one = 1
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i) and not constraint.leads(s, w, i):
                one = 0
        return one

    @ti.func
    def is_behind(self, w, r):
        """Return whether a point (m) is behind one of the planes."""
        behind = 0
        for k in range(self.planes.size(w)):
            if self.planes.distance(w, k, r) < 0.0:
                behind = 1
        return behind
