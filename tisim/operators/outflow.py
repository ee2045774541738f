"""Outflow: grains that leave through a plane are removed and weighed."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.operators.behind_planes import BehindPlanes
from tisim.state.fields import WorldField


class Outflow(BehindPlanes):
    """Grains whose centres are behind a plane, on the side opposite to the normal, are removed.

    A rigid clump is removed as a whole, when its centre of mass is behind the plane. ``work["outflow"]`` is
    the number of removed grains, with a clump as one, and ``measures["outflow_mass"]`` their mass (kg). The
    discharge rate is the growth of either: record it with ``MeasureSeries``, and see
    ``tisim.analysis.discharge_rate``.
    """

    fields = ("radius",)
    world_fields = (
        WorldField("outflow", "counter"),
        WorldField("outflow_mass", "measure", "kg"),
        WorldField("outflow_due", "integer"),
    )
    terms: ClassVar = 2

    @ti.func
    def particle(self, s, w, i, t, dt):
        if self.is_behind(s, w, i):
            ti.atomic_max(s.outflow_due[w], 1)

    @ti.func
    def acts(self, s, w):
        return s.outflow_due[w]

    @ti.func
    def each(self, s, w, i):
        terms = ti.Vector.zero(ti.f64, self.terms)
        if self.is_behind(s, w, i):
            terms = ti.Vector([ti.cast(self.counts(s, w, i), ti.f64), ti.cast(s.mass[w, i], ti.f64)])
            s.remove(w, i)
        return terms

    @ti.func
    def world(self, s, w):
        s.outflow_due[w] = 0
        total = self.sums.total(w)
        s.outflow[w] += ti.cast(total[0], ti.i64)
        s.outflow_mass[w] += total[1]

    @ti.func
    def counts(self, s, w, i):
        """Return 1 for a particle that represents a grain, 0 for the other particles of its clump."""
        one = 1
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i) and not constraint.leads(s, w, i):
                one = 0
        return one
