"""The loops that sum a scene's forces; they know no physics."""

from tisim._taichi import ti
from tisim.domain import Domain
from tisim.effect import Force, PairForce
from tisim.mutual import Mutual
from tisim.program import PerParticle
from tisim.state import Field, State

FORCE = Field("force", "N", 3, "sum")


class SumForces(PerParticle):
    """force[w, i] = sum of the scene's forces on i: single, all pairs, near pairs; each in a fixed order."""

    def __init__(
        self,
        s: State,
        domain: Domain,
        forces: tuple[Force, ...],
        pair_forces: tuple[PairForce, ...],
        mutual: Mutual | None,
    ) -> None:
        super().__init__(s)
        self.domain, self.forces, self.pair_forces = domain, forces, pair_forces
        self.long_ranged = tuple(f for f in pair_forces if not f.short_ranged)
        self.short_ranged = tuple(f for f in pair_forces if f.short_ranged)
        self.mutual = mutual

    @ti.func
    def run(self, w, i):
        s = self.s
        t = s.time[w]
        total = 0.0 * s.velocity[w, i]
        for effect in ti.static(self.forces):
            total += effect.force(s, w, i, t)
        if ti.static(len(self.long_ranged) > 0):
            for j in range(s.count[w]):
                total += self.pair(self.long_ranged, w, i, j, t)
        if ti.static(len(self.short_ranged) > 0):
            near = self.mutual.near
            for k in range(near.size(w, i)):
                total += self.pair(self.short_ranged, w, i, near.candidate(w, i, k), t)
            for k in range(self.mutual.size(w, i)):
                total += self.pair(self.short_ranged, w, i, self.mutual.candidate(w, i, k), t)
        s.force[w, i] = total
        # Not below infinity: also true of NaN.
        if not (total.norm_sqr() < ti.math.inf):
            self.find_fault(w, i)

    @ti.func
    def pair(self, effects: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Sum of the pair forces of ``effects`` on i by j; none of itself."""
        s = self.s
        total = 0.0 * s.velocity[w, i]
        if i != j:
            d = self.domain.separation(w, s.position[w, i], s.position[w, j])
            distance = d.norm()
            for effect in ti.static(effects):
                total += effect.pair_force(s, w, i, j, d, distance, t)
        return total

    @ti.func
    def find_fault(self, w, i):
        """Say which force it was."""
        s = self.s
        for effect in ti.static(self.forces):
            if not (effect.force(s, w, i, s.time[w]).norm_sqr() < ti.math.inf):
                s.fault(w, i, effect.index)
        for effect in ti.static(self.pair_forces):
            for j in range(s.count[w]):
                if not (self.pair((effect,), w, i, j, s.time[w]).norm_sqr() < ti.math.inf):
                    s.fault(w, i, effect.index)


class SumForcesAgain(SumForces):
    """After events have changed who is where: the forces that the next step begins with."""

    conditional = True

    @ti.func
    def when(self, w):
        return self.s.events[w]
