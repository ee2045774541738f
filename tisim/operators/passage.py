"""Passage: grains that pass a plane are weighed, and the mean rate of passage is recorded."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.operators.base import parameter
from tisim.operators.behind_planes import BehindPlanes
from tisim.operators.outflow import Outflow
from tisim.state.fields import Field, WorldField


class Passage(BehindPlanes):
    """Grains whose centres get behind a plane, on the side opposite to the normal, are weighed once; the
    motion is not changed. A rigid clump passes as a whole, when its centre of mass does.

        passage_rate = (m_2 - m_1) / (t_2 - t_1)

    ``measures["passed_mass"]`` is the mass (kg) that has passed. ``passage_rate`` (kg/s) is the mean rate
    while that mass grew from m_1, its first value at or above ``begin``, to m_2, its last value at or below
    ``end``; it is 0 before. For a hopper this is the rate in steady flow, without the onset and the emptying.
    The field ``passed`` is 1 for a grain that has passed. An ``outflow`` that comes later in the scene may
    remove such grains afterwards.
    """

    fields: ClassVar = (Field("passed", "", 1, "keep", integer=True, default=0),)
    world_fields: ClassVar = (
        WorldField("passed_mass", "measure", "kg"),
        WorldField("passage_rate", "measure", "kg/s"),
        WorldField("passage_begin_time", "measure", "s"),
        WorldField("passage_begin_mass", "measure", "kg"),
        WorldField("passage_due", "integer"),
    )
    terms: ClassVar = 1
    # Removed grains have no mass left to weigh.
    precedes: ClassVar = (Outflow,)

    begin: float = parameter("kg", "passed mass from which on the rate is measured", 0.0, ge=0)
    end: float = parameter("kg", "passed mass up to which the rate is measured", 1e30, gt=0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.passed[w, i] == 0 and self.is_behind(s, w, i):
            ti.atomic_max(s.passage_due[w], 1)

    @ti.func
    def acts(self, s, w):
        return s.passage_due[w]

    @ti.func
    def each(self, s, w, i):
        terms = ti.Vector.zero(ti.f64, self.terms)
        if s.passed[w, i] == 0 and self.is_behind(s, w, i):
            s.passed[w, i] = 1
            terms[0] = ti.cast(s.mass[w, i], ti.f64)
        return terms

    @ti.func
    def world(self, s, w):
        s.passage_due[w] = 0
        s.passed_mass[w] += self.sums.total(w)[0]
        mass, began = s.passed_mass[w], s.passage_begin_mass[w]
        if began == 0.0 and mass >= self.begin(w):
            s.passage_begin_mass[w], s.passage_begin_time[w] = mass, s.time[w]
        if began > 0.0 and mass <= self.end(w) and s.time[w] > s.passage_begin_time[w]:
            s.passage_rate[w] = (mass - began) / (s.time[w] - s.passage_begin_time[w])
