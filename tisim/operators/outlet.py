"""Outlet: particles that leave with the flow are taken out of it and remain as a record."""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint, PairEvent, PairForce, SelfConsistentQuantity
from tisim.operators.behind_planes import BehindPlanes
from tisim.state.fields import Field, WorldField


class Outlet(BehindPlanes):
    """Particles whose centres get behind a plane, on the side opposite to the normal, leave.

    A particle that has left is ``fixed`` and takes part in nothing more. It remains in the state, with its
    size and with the time at which it left, ``exited_at`` (s), -1 before, as the end of the step in which it
    passed the plane: breakthrough curves are made from these (``tisim.analysis.breakthrough_curve``).
    ``work["exited"]`` is the number of particles that have left. Particles must not interact; for particles
    that do, use ``outflow``, which removes them.
    """

    fields: ClassVar = ("fixed", Field("exited_at", "s", 1, "keep", default=-1.0, double=True))
    world_fields: ClassVar = (WorldField("exited", "counter"),)
    excludes: ClassVar = (PairForce, PairEvent, Constraint, SelfConsistentQuantity)

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.fixed[w, i] == 0 and self.is_behind(s, w, i):
            s.fixed[w, i], s.exited_at[w, i] = 1, t
            s.velocity[w, i] = 0.0 * s.velocity[w, i]
            ti.atomic_add(s.exited[w], 1)
