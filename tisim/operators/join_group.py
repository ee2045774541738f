"""Joining a group: free grains of a layer begin, at a time, to move as prescribed."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect
from tisim.effects.constraint.prescribed_motion import PrescribedMotion
from tisim.errors import must
from tisim.operators.base import option, parameter
from tisim.operators.behind_planes import BehindPlanes
from tisim.worlds.bound import Peers


class JoinGroup(BehindPlanes):
    """Free grains that are behind a plane at a time join a group that moves as prescribed.

    It freezes part of what has come about by then, or drives it: the grains that are at the bottom of a bed
    become its rough floor, the ends of chains those that are drawn apart. Those whose centres are on the side
    that the normal of one of the ``planes`` points away from, and that nothing holds yet, join the ``group``
    of a ``prescribed_motion``, at the end of the first step that reaches ``time``; they go on from where they
    are, at the velocity of the motion. ``work["joined"]`` counts them. It is ``group`` and ``fix move`` of
    LAMMPS, between two of its ``run``.
    """

    fields: ClassVar = ("group",)
    counters: ClassVar = ("joined",)
    requires: ClassVar = (PrescribedMotion,)
    repeatable: ClassVar[bool] = True

    group: int = option("number of the group that they join", 1, gt=0)
    time: float = parameter("s", "time at which they join", examples=[1e-3], gt=0)

    def gives(self, constraint: Effect) -> bool:
        return isinstance(constraint, PrescribedMotion) and constraint.group == self.group

    def connect(self, peers: Peers) -> dict[str, Any]:
        groups = peers.of(PrescribedMotion)
        joins = [one for one in groups if one.data.group == self.group]
        rule = f"that of a prescribed motion ({', '.join(str(one.data.group) for one in groups)})"
        must(len(joins) == 1, f"effects.{self.label}.group", rule, self.group)
        return {**super().connect(peers), "motion_of_group": joins[0]}

    @ti.func
    def acts(self, s, w):
        due = ti.cast(self.time(w), ti.f64)
        return ti.cast(s.time[w] >= due and s.time[w] - s.dt[w] < due, ti.i32)

    @ti.func
    def world(self, s, w):
        for i in range(s.count[w]):
            if self.is_free(s, w, i) and self.is_behind(s, w, i):
                self.motion_of_group.join(s, w, i)
                s.joined[w] += 1
        # Laws that act within a short range no longer act between two that have joined.
        s.invalidate_lists(w)

    @ti.func
    def is_free(self, s, w, i):
        free = s.mass[w, i] > 0.0
        if ti.static(hasattr(s, "fixed")):
            free = free and s.fixed[w, i] == 0
        for constraint in ti.static(self.constraints):
            free = free and not constraint.holds(s, w, i)
        return free
