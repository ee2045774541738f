"""Force and torque on every particle."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.interactions.pair_sum import PairSum
from tisim.numerics.ieee import finite
from tisim.numerics.roots import estimates_roots
from tisim.worlds.fields import Field
from tisim.worlds.status import WorldStatus

if TYPE_CHECKING:
    from tisim.components.domain import Domain
    from tisim.interactions.pair_chunks import PairChunks
    from tisim.worlds.bound import Bound, Peers
    from tisim.worlds.state import State

FORCE = Field("force", "N", 3, "sum")
TORQUE = Field("torque", "N m", 3, "sum")


def turning(effects: Sequence[Effect]) -> bool:
    """Return whether any of these exerts torques."""
    return any(
        effect.offers("torque") or effect.offers("load")
        if isinstance(effect, Force)
        else effect.offers("pair_torque") or effect.offers("interaction")
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
    """This phase sets force[w, i] to the sum of the scene's forces on i: single, all pairs, near pairs; each
    in a fixed order.

    Where an effect of the scene exerts torques these are summed along with it: one vector of six. A particle
    that is ``fixed``, where the scene has that field, takes none. What pairs remember advances with the sum.

    trial : whether the state is one that may be given up. elapsed : whether pairs have gone on for ``dt``
    since their memory was last brought up to date. commits : whether it now is.
    """

    trial: ClassVar[bool] = False
    elapsed: ClassVar[bool] = True
    commits: ClassVar[bool] = True

    def __init__(
        self,
        s: "State",
        domain: "Bound[Domain]",
        effects: "Peers",
        pairs: "PairChunks | None",
        derived_solvers: tuple[Any, ...],
    ) -> None:
        self.forces, self.pair_forces = effects.of(Force), effects.of(PairForce)
        super().__init__(s, domain, self.pair_forces, pairs)
        self.derived_solvers = derived_solvers
        self.turning = turning([effect.data for effect in effects])
        self.fixes = any(field.name == "fixed" for field in s.fields)
        self.wrench, self.components = (_both, 6) if self.turning else (_force, 3)
        able = all(effect.data.offers("pair_force_by_inverse") for effect in self.long_ranged)
        self.by_inverse = able and not self.turning and estimates_roots()

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
        """Set the force on i, at a time of its own, where particles do not feel each other."""
        for solver in ti.static(self.derived_solvers):
            solver.set(self.s, w, i, t)
        self.write(w, i, self.singles(w, i, t))

    @ti.func
    def singles(self, w, i, t):
        """Return the sum of the forces on i by itself."""
        s = self.s
        total = self.wrench(0.0 * s.velocity[w, i], 0.0 * s.velocity[w, i])
        if self.moves(w, i):
            for effect in ti.static(self.forces):
                total += self.single(effect, w, i, t)
        return total

    @ti.func
    def put(self, w, i, total):
        # Not +=, which would be atomic.
        self.write(w, i, total)

    @ti.func
    def get(self, w, i):
        s = self.s
        total = self.wrench(s.force[w, i], s.force[w, i])
        if ti.static(self.turning):
            total = self.wrench(s.force[w, i], s.torque[w, i])
        return total

    @ti.func
    def terms_of_pair(self, w, m, i, j, separation, distance, t):
        force, turn, back = self.interaction(self.short_ranged[0], w, m, i, j, separation, distance, t)
        for effect in ti.static(self.short_ranged[1:]):
            more = self.interaction(effect, w, m, i, j, separation, distance, t)
            force, turn, back = force + more[0], turn + more[1], back + more[2]
        return self.wrench(force, turn), self.wrench(-force, back)

    @ti.func
    def interaction(self, effect: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return force and torques of one law between listed pair m; what it remembers goes on."""
        s, dt = self.s, self.gone_by(w)
        past = ti.Vector.zero(s.real, max(1, effect.memory))
        if ti.static(effect.memory > 0):
            past = effect.past.read(w, m)
        force, turn, back, known = effect.interaction(s, w, i, j, separation, distance, past, dt, t)
        if ti.static(effect.memory > 0 and self.commits):
            effect.past.write(w, m, known)
        return force, turn, back

    @ti.func
    def gone_by(self, w):
        """Return the time (s) since what particles remember was last brought up to date."""
        dt = ti.cast(0.0, self.s.real)
        if ti.static(self.elapsed):
            dt = ti.cast(self.s.dt[w], self.s.real)
        return dt

    @ti.func
    def out_of_reach(self, w, m):
        if ti.static(self.commits):
            for effect in ti.static(self.short_ranged):
                if ti.static(effect.memory > 0):
                    effect.past.forget(w, m)

    @ti.func
    def moves(self, w, i):
        """Return whether forces may move i."""
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
        if not finite(total.norm_sqr()):
            self.s.fail_by_force(w, WorldStatus.NOT_FINITE, i)

    @ti.func
    def single(self, effect: ti.template(), w, i, t):  # type: ignore[valid-type]
        force, torque = effect.load(self.s, w, i, t, self.gone_by(w), self.commits)
        return self.wrench(force, torque)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        return self.wrench(
            effect.pair_force(s, w, i, j, separation, distance, t),
            effect.pair_torque(s, w, i, j, separation, distance, t),
        )

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        return effect.pair_force_by_inverse(self.s, w, i, j, separation, inverse, t)

    @ti.func
    def by_other(self, effect: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Return what j does to i by one law, given what they have stored of each other."""
        s = self.s
        d = self.domain.separation(w, s.position[w, i], s.position[w, j])
        first, second, sign = i, j, ti.cast(1.0, s.real)
        if s.id[w, i] > s.id[w, j]:
            first, second, sign = j, i, ti.cast(-1.0, s.real)
        past, dt = ti.Vector.zero(s.real, max(1, effect.memory)), self.gone_by(w)
        if ti.static(effect.memory > 0):
            past = effect.past.stored(w, i, j) + effect.past.stored(w, j, i)
        force, turn, back, _ = effect.interaction(s, w, first, second, sign * d, d.norm(), past, dt, t)
        return self.wrench(sign * force, ti.select(first == i, turn, back))

    @ti.func
    def largest(self, w, i, t):
        """Return the index of the effect whose force on i is largest, or not finite, or is set to nothing
        finite."""
        s = self.s
        most, index = ti.cast(-1.0, s.real), 0
        for effect in ti.static(self.forces):
            size = self.single(effect, w, i, t).norm()
            if finite(most) and not (size <= most):
                most, index = size, effect.index
        for effect in ti.static(self.pair_forces):
            total = ti.Vector.zero(s.real, self.components)
            for j in range(s.count[w]):
                if i != j:
                    total += self.by_other(effect, w, i, j, t)
            if finite(most) and not (total.norm() <= most):
                most, index = total.norm(), effect.index
        for solver in ti.static(self.derived_solvers):
            if not finite(solver.size(solver.value[w, i])):
                index = solver.effect.index
        return index


class SumTrialForces(SumForces):
    """This phase sums the forces of a trial state, which may be one that is to be given up: whatever is not
    finite may stay."""

    trial, commits = True, False

    @ti.func
    def check(self, w, i, total):
        pass


class SumForcesAtStart(SumForces):
    """Sum the forces that a first step begins with, at the start or after a world has been written to.

    No time has gone by.
    """

    elapsed = False


class SumForcesAgain(SumForces):
    """After events have changed who is where, this phase sums the forces that the next step begins with."""

    conditional, elapsed, commits = True, False, False

    @ti.func
    def when(self, w):
        return self.s.events[w]
