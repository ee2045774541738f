"""The loops that sum a scene's forces; they know no physics."""

from __future__ import annotations

from tisim._taichi import ti
from tisim.domain import Domain
from tisim.effect import Force, PairForce
from tisim.program import PerParticle
from tisim.state import Field, State

FORCE = Field("force", "N", 3, "sum")


class SumForces(PerParticle):
    """force[w, i] = sum of the scene's forces on i, in scene order; pairs in the order of indices."""

    def __init__(
        self, s: State, domain: Domain, forces: tuple[Force, ...], pair_forces: tuple[PairForce, ...]
    ) -> None:
        super().__init__(s)
        self.domain, self.forces, self.pair_forces = domain, forces, pair_forces

    @ti.func
    def run(self, w, i):
        s = self.s
        t = s.time[w]
        total = 0.0 * s.velocity[w, i]
        for effect in ti.static(self.forces):
            total += effect.force(s, w, i, t)
        if ti.static(len(self.pair_forces) > 0):
            for j in range(s.count[w]):
                if i != j:
                    d = self.domain.separation(w, s.position[w, i], s.position[w, j])
                    distance = d.norm()
                    for effect in ti.static(self.pair_forces):
                        total += effect.pair_force(s, w, i, j, d, distance, t)
        s.force[w, i] = total
