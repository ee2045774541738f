"""The pull of an uneven magnetic field on magnetic moments (B16 Eq. 6.20)."""

from __future__ import annotations

from typing import Any

from tisim.backend.taichi import ti
from tisim.effects.base import Force
from tisim.effects.magnetic.moment import MOMENT
from tisim.sources.base import sources
from tisim.worlds.bound import Peers


class Magnetophoresis(Force):
    """An uneven magnetic field pulls particles by their magnetic moments.

        F = (m.grad) B

    B is the sum of all sources, m the ``moment`` that another effect has set. Where B is free of curl, as it
    is where no current flows, this is grad(m.B) with m held fixed; of a moment that goes with B it is half of
    grad(m.B) with m varying, which is ``magnetic_body_force``. What moments do to each other is
    ``dipole_dipole``.

    Source: B16 Eqs (6.20), (7.1).
    """

    fields = (MOMENT,)
    requires_source = ("magnetic_flux_density",)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"applied": sources(peers, "magnetic_flux_density")}

    @ti.func
    def force(self, s, w, i, t):
        gradient = ti.Matrix.zero(s.real, 3, 3)
        for source in ti.static(self.applied):
            gradient += source.gradient(w, s.position[w, i], t)
        return gradient @ s.moment[w, i]
