"""Joining a group: at a given time, free grains of a layer begin to move as prescribed."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect
from tisim.effects.constraint.prescribed_motion import PrescribedMotion
from tisim.errors import must
from tisim.operators.at_intervals import AtIntervals
from tisim.operators.base import option, parameter
from tisim.operators.behind_planes import BehindPlanes
from tisim.state.bound import Peers
from tisim.state.fields import WorldField

NEARLY = 1e-6
"""A step has reached a time if it ends before it by at most this part of the step's length (rounding)."""


class JoinGroup(BehindPlanes, AtIntervals):
    """At a given time, free grains behind a plane join a group that moves as prescribed.

    This freezes or drives part of a structure that has formed: the bottom grains of a bed become its rough
    floor, or the end grains of chains pull the chains apart. A grain joins if its centre is on the side of
    one of the ``planes`` opposite to the normal and no constraint holds it yet. It joins the ``group`` of a
    ``prescribed_motion`` at the end of the first step that reaches ``time``, and moves on from its place at
    the velocity of the motion. ``work["joined"]`` is the number of such grains. In LAMMPS this is ``group``
    and ``fix move`` between two ``run`` commands.
    """

    fields: ClassVar = ("group",)
    world_fields: ClassVar = (WorldField("joined", "counter"),)
    terms: ClassVar = 1
    requires: ClassVar = (PrescribedMotion,)
    repeatable: ClassVar[bool] = True

    group: int = option("number of the group that they join", 1, gt=0)
    time: float = parameter("s", "time at which they join", examples=[1e-3], gt=0)

    def gives(self, constraint: Effect) -> bool:
        return isinstance(constraint, PrescribedMotion) and constraint.group == self.group

    def connect(self, peers: Peers) -> dict[str, Any]:
        groups = peers.of(PrescribedMotion)
        joins = [one for one in groups if one.data.group == self.group]
        rule = f"the group of a prescribed motion ({', '.join(str(one.data.group) for one in groups)})"
        must(len(joins) == 1, f"effects.{self.label}.group", rule, self.group)
        return {**super().connect(peers), "motion_of_group": joins[0]}

    @ti.func
    def elapsed(self, s, w):
        # Only once: later grains stay free. The tolerance keeps rounding from delaying the action by a step.
        reached = s.time[w] + NEARLY * s.dt[w]
        return ti.min(reached / ti.cast(self.time(w), ti.f64), 1.0)

    @ti.func
    def each(self, s, w, i):
        joins = ti.cast(0.0, ti.f64)
        if self.is_free(s, w, i) and self.is_behind(s, w, i):
            self.motion_of_group.join(s, w, i)
            joins = 1.0
        return ti.Vector([joins])

    @ti.func
    def world(self, s, w):
        self.count_interval(s, w)
        s.joined[w] += ti.cast(self.sums.total(w)[0], ti.i64)
        # Short-range laws no longer act between two grains that have both joined.
        s.invalidate_lists(w)

    @ti.func
    def is_free(self, s, w, i):
        free = True
        if ti.static(hasattr(s, "fixed")):
            free = s.fixed[w, i] == 0
        for constraint in ti.static(self.constraints):
            free = free and not constraint.holds(s, w, i)
        return free
