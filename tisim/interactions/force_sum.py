"""Force and torque on every particle."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.interactions.pair_sum import PairSum
from tisim.worlds.fields import Field
from tisim.worlds.status import WorldStatus

if TYPE_CHECKING:
    from tisim.components.domain import Domain
    from tisim.neighbours.full_list import FullNeighbourList
    from tisim.worlds.bound import Bound, Peers
    from tisim.worlds.state import State

FORCE = Field("force", "N", 3, "sum")
TORQUE = Field("torque", "N m", 3, "sum")


def turning(effects: Sequence[Effect]) -> bool:
    """Return whether any of these exerts torques."""
    return any(
        effect.offers("torque" if isinstance(effect, Force) else "pair_torque")
        for effect in effects
        if isinstance(effect, Force | PairForce)
    )


@ti.func
def _both(force, torque):
    return ti.Vector([force[0], force[1], force[2], torque[0], torque[1], torque[2]])


@ti.func
def _force(force, torque):
    return force


class SumForces(PairSum):
    """force[w, i] = sum of the scene's forces on i: single, all pairs, near pairs; each in a fixed order.

    Where an effect of the scene exerts torques these are summed along with it: one vector of six. A particle
    that is ``fixed``, where the scene has that field, takes none.
    """

    trial: ClassVar[bool] = False

    def __init__(
        self,
        s: "State",
        domain: "Bound[Domain]",
        effects: "Peers",
        full_list: "FullNeighbourList | None",
        derived_solvers: tuple[Any, ...],
    ) -> None:
        self.forces, self.pair_forces = effects.of(Force), effects.of(PairForce)
        super().__init__(s, domain, self.pair_forces, full_list)
        self.derived_solvers = derived_solvers
        self.turning = turning([effect.data for effect in effects])
        self.fixes = any(field.name == "fixed" for field in s.fields)
        self.wrench, self.components = (_both, 6) if self.turning else (_force, 3)

    @ti.func
    def start(self, w, i, t):
        return self.singles(w, i, t)

    @ti.func
    def finish(self, w, i, total, t):
        taken = ti.select(self.moves(w, i), total, 0.0)
        self.write(w, i, taken)
        self.check(w, i, taken)

    @ti.func
    def single_particle(self, w, i, t):
        """The force on i, at a time of its own, where particles do not feel each other."""
        for solver in ti.static(self.derived_solvers):
            solver.set(self.s, w, i, t)
        self.write(w, i, self.singles(w, i, t))

    @ti.func
    def singles(self, w, i, t):
        """Sum of the forces on i by itself."""
        s = self.s
        total = self.wrench(0.0 * s.velocity[w, i], 0.0 * s.velocity[w, i])
        if self.moves(w, i):
            for effect in ti.static(self.forces):
                total += self.single(effect, w, i, t)
        return total

    @ti.func
    def moves(self, w, i):
        """Whether forces may move i."""
        free = True
        if ti.static(self.fixes):
            free = self.s.fixed[w, i] == 0
        return free

    @ti.func
    def write(self, w, i, total):
        s = self.s
        for k in ti.static(range(3)):
            s.force[w, i][k] = total[k]
            if ti.static(self.turning):
                s.torque[w, i][k] = total[3 + k]

    @ti.func
    def check(self, w, i, total):
        # Not below infinity: also true of NaN.
        if not (total.norm_sqr() < ti.math.inf):
            self.s.fail_by_force(w, WorldStatus.NOT_FINITE, i)

    @ti.func
    def single(self, effect: ti.template(), w, i, t):  # type: ignore[valid-type]
        return self.wrench(effect.force(self.s, w, i, t), effect.torque(self.s, w, i, t))

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        return self.wrench(
            effect.pair_force(s, w, i, j, separation, distance, t),
            effect.pair_torque(s, w, i, j, separation, distance, t),
        )

    @ti.func
    def largest(self, w, i, t):
        """Index of the effect whose force on i is largest, or not finite, or is set to nothing finite."""
        s = self.s
        most, index = ti.cast(-1.0, s.real), 0
        for effect in ti.static(self.forces):
            size = self.single(effect, w, i, t).norm()
            if most < ti.math.inf and not (size <= most):
                most, index = size, effect.index
        for effect in ti.static(self.pair_forces):
            total = ti.Vector.zero(s.real, self.components)
            for j in range(s.count[w]):
                total += self.of((effect,), w, i, j, t)
            if most < ti.math.inf and not (total.norm() <= most):
                most, index = total.norm(), effect.index
        for solver in ti.static(self.derived_solvers):
            if not (solver.size(solver.value[w, i]) < ti.math.inf):
                index = solver.effect.index
        return index


class SumTrialForces(SumForces):
    """Sum the forces of a trial state, which may be one that is to be given up: whatever is not finite may
    stay."""

    trial = True

    @ti.func
    def check(self, w, i, total):
        pass


class SumForcesAgain(SumForces):
    """After events have changed who is where: the forces that the next step begins with."""

    conditional = True

    @ti.func
    def when(self, w):
        return self.s.events[w]
