"""Capture: a particle that touches a magnet of the scene is fixed there (B16 section 6.3)."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint, PairEvent
from tisim.operators.base import Operator
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers
from tisim.state.fields import Field, WorldField


class Capture(Operator):
    """A particle that touches a magnet of the scene is fixed at the point of contact.

    A particle whose surface meets the surface of a magnet is placed on it and fixed: no force moves it any
    more, but it still acts on others. Three fields describe this: ``fixed`` is 1 (the initial state may fix
    particles too, which are not counted); ``captured_by`` is the number of the magnet, counted from 0 through
    the lists of the scene in order, or -1; ``captured_at`` is the end of the step in which the particle
    touched (s), or -1. ``work["captures"]`` is the number of captured particles. A particle whose step ends
    inside a magnet is moved to the nearest point outside, so the path in a step must be short compared with
    the size of the magnet. Impacts are refused, because they would move a captured particle.

    Source: B16 section 6.3.
    """

    fields: ClassVar = (
        "radius",
        "fixed",
        Field("captured_by", "", 1, "keep", integer=True, default=-1),
        Field("captured_at", "s", 1, "keep", default=-1.0),
    )
    world_fields: ClassVar = (WorldField("captures", "counter"),)
    requires: ClassVar = (Magnets,)
    excludes: ClassVar = (PairEvent, Constraint)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"magnets": peers.of(Magnets)}

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.fixed[w, i] == 0:
            r, radius = s.position[w, i], s.radius[w, i]
            before, by, least, place = 0, -1, radius, r
            for magnets in ti.static(self.magnets):
                for k in range(magnets.each.size(w)):
                    distance, normal = magnets.each.nearest(w, k, r)
                    if distance <= least:
                        least, by = distance, before + k
                        place = r + (radius - distance) * normal
                before += magnets.each.size(w)
            if by >= 0:
                s.fixed[w, i] = 1
                s.captured_by[w, i] = by
                s.captured_at[w, i] = ti.cast(t, s.real)
                s.position[w, i] = place
                s.velocity[w, i] = 0.0 * r
                if ti.static(hasattr(s, "spin")):
                    s.spin[w, i] = 0.0 * r
                ti.atomic_add(s.captures[w], 1)
