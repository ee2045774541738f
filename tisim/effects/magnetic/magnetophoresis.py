"""The force and torque of a magnetic field on magnetic moments (B16 Eq. 6.20, L21 Eq. 4.7)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, keeps_apart
from tisim.effects.magnetic.moment import MOMENT
from tisim.effects.magnetic.permanent_moment import PermanentMoment
from tisim.sources.base import sources
from tisim.state.bound import Peers


class Magnetophoresis(Force):
    """A non-uniform magnetic field pulls magnetic moments, and any field exerts torques on permanent moments.

        F = (m.grad) B,    T = m x B

    B is the sum of all sources, and m the ``moment`` that another effect has set. If B is free of curl, as it
    is without currents, the force is grad(m.B) with m held fixed. For a moment proportional to B this is half
    of grad(m.B) with m varying, the force of ``magnetic_body_force``. The forces between moments are in
    ``dipole_dipole``. The torque T acts on particles whose moments rotate with them (``permanent_moment``);
    soft moments rotate inside the particle, which feels no torque.

    Source: B16 Eqs (6.20), (7.1), L21 Eqs (4.6), (4.7).
    """

    fields = (MOMENT,)
    requires_source = ("magnetic_flux_density",)

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Contacts are far stiffer; the effect of permanent moments gives its own limit.
        permanent = any(isinstance(one, PermanentMoment) for one in effects)
        return math.inf if permanent or keeps_apart(effects) else None

    def turns(self, effects: Sequence[Effect]) -> bool:
        return any(isinstance(effect, PermanentMoment) for effect in effects)

    def connect(self, peers: Peers) -> dict[str, Any]:
        applied = sources(peers, "magnetic_flux_density")
        return {"applied": applied, "permanent": bool(peers.of(PermanentMoment))}

    @ti.func
    def force(self, s, w, i, t):
        gradient = ti.Matrix.zero(s.real, 3, 3)
        for source in ti.static(self.applied):
            gradient += source.gradient(w, s.position[w, i], t)
        return gradient @ s.moment[w, i]

    @ti.func
    def torque(self, s, w, i, t):
        torque = 0.0 * s.moment[w, i]
        if ti.static(self.permanent):
            b = 0.0 * torque
            for source in ti.static(self.applied):
                b += source.value(w, s.position[w, i], t)
            torque = s.moment[w, i].cross(b)
        return torque
