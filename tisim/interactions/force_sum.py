"""Force and torque on every particle."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.interactions.pair_sum import PairSum
from tisim.numerics.ieee import finite
from tisim.numerics.roots import estimates_roots
from tisim.numerics.vectors import piece
from tisim.worlds.fields import Field
from tisim.worlds.occasion import Occasion
from tisim.worlds.status import WorldStatus

if TYPE_CHECKING:
    from tisim.components.domain import Domain
    from tisim.interactions.pair_chunks import PairChunks
    from tisim.worlds.bound import Bound, Peers
    from tisim.worlds.state import State

FORCE = Field("force", "N", 3, "sum")
TORQUE = Field("torque", "N m", 3, "sum")
VIRIAL = Field("virial", "J", 1, "keep", slots=9)
"""This is the half of a particle in the virial of its pairs: xx, xy, xz, yx, ... zz."""


def turning(effects: Sequence[Effect]) -> bool:
    """Return whether any of these exerts torques."""
    return any(effect.turns(effects) for effect in effects if isinstance(effect, Force | PairForce))


@ti.func
def _force_and_torque(force, torque):
    return ti.Vector([force[0], force[1], force[2], torque[0], torque[1], torque[2]])


@ti.func
def _force_alone(force, torque):
    return force


@ti.func
def _load_alone(load, separation):
    return load


class SumForces(PairSum):
    """This phase sets force[w, i] to the sum of the scene's forces on i: single, all pairs, near pairs; each
    in a fixed order.

    Where an effect of the scene exerts torques these are summed along with it: one vector of six, the load. A
    particle that is ``fixed``, where the scene has that field, takes none. Where the scene has the field
    ``virial`` nine more are summed: the half of i in that of its pairs. What pairs remember advances with the
    sum.

    trial : whether the state is one that may be given up. commits : whether what pairs remember may be
    brought up to date with it.
    """

    trial: ClassVar[bool] = False
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
        self.half_list: Any = pairs.half_list if pairs else None
        self.turning = turning([effect.data for effect in effects])
        self.has_fixed = any(field.name == "fixed" for field in s.fields)
        self.has_virial = VIRIAL in s.fields
        self.wrench, self.load_size = (_force_and_torque, 6) if self.turning else (_force_alone, 3)
        self.summand = self.load_and_virial if self.has_virial else _load_alone
        self.components = self.load_size + (VIRIAL.slots if self.has_virial else 0)
        # A listed pair comes to a force, torques on both, how far apart they are where that is of use, and
        # what each law has it remember.
        self.separation_begin = 9 if self.turning else 3
        self.pair_values, laws = self.separation_begin + (3 if self.has_virial else 0), []
        for law in self.short_ranged:
            laws.append((law, self.pair_values))
            self.pair_values += law.data.memory if self.commits else 0
        self.laws = tuple(laws)
        # Values have no room for memory where the sum may not advance it.
        self.remembering = tuple((law, begin) for law, begin in laws if self.commits and law.data.memory)
        self.remembers = any(
            effect.data.offers("load" if isinstance(effect.data, Force) else "interaction")
            for effect in (*self.forces, *self.pair_forces)
        )
        able = all(effect.data.offers_inverse() for effect in self.long_ranged)
        self.by_inverse = able and not self.turning and not self.has_virial and estimates_roots()

    @ti.func
    def load_and_virial(self, load, separation):
        """Return a load by another particle, which is at ``separation`` (m), with the half of its virial that
        is of the one it acts on."""
        total = ti.Vector.zero(self.s.real, self.components)
        for k in ti.static(range(self.load_size)):
            total[k] = load[k]
        for a, b in ti.static(ti.ndrange(3, 3)):
            total[self.load_size + 3 * a + b] = -0.5 * separation[a] * load[b]
        return total

    @ti.func
    def start(self, w, i, t):
        return self.summand(self.external_load(w, i, t), 0.0 * self.s.position[w, i])

    @ti.func
    def finish(self, w, i, total, t):
        taken = total
        if ti.static(self.has_fixed):
            for k in ti.static(range(self.load_size)):
                taken[k] = ti.select(self.is_free(w, i), total[k], 0.0)
        self.write(w, i, taken)
        self.check(w, i, taken)

    @ti.func
    def single_particle(self, w, i, t):
        """Set the force on i, at a time of its own, where particles do not feel each other."""
        for solver in ti.static(self.derived_solvers):
            solver.set(self.s, w, i, t)
        self.write(w, i, self.external_load(w, i, t))

    @ti.func
    def external_load(self, w, i, t):
        """Return the sum of the forces on i that no other particle exerts, with their torques."""
        s = self.s
        total = self.wrench(0.0 * s.velocity[w, i], 0.0 * s.velocity[w, i])
        if self.is_free(w, i):
            for effect in ti.static(self.forces):
                total += self.load_by(effect, w, i, t)
        return total

    @ti.func
    def write_sum(self, w, i, total):
        # Not +=, which would be atomic.
        self.write(w, i, total)

    @ti.func
    def read_sum(self, w, i):
        s = self.s
        load = self.wrench(s.force[w, i], s.force[w, i])
        if ti.static(self.turning):
            load = self.wrench(s.force[w, i], s.torque[w, i])
        total = self.summand(load, 0.0 * s.force[w, i])
        if ti.static(self.has_virial):
            for k in ti.static(range(VIRIAL.slots)):
                total[self.load_size + k] = s.virial[w, i, k]
        return total

    @ti.func
    def compute_pair(self, w, m, i, j, separation, distance, t):
        values = ti.Vector.zero(self.s.real, self.pair_values)
        for law, begin in ti.static(self.laws):
            force, torque_i, torque_j, memory = self.interaction(law, w, m, i, j, separation, distance, t)
            for k in ti.static(range(3)):
                values[k] += force[k]
                if ti.static(self.turning):
                    values[3 + k] += torque_i[k]
                    values[6 + k] += torque_j[k]
            if ti.static(self.commits):
                for k in ti.static(range(law.memory)):
                    values[begin + k] = memory[k]
        if ti.static(self.has_virial):
            for k in ti.static(range(3)):
                values[self.separation_begin + k] = separation[k]
        return values

    @ti.func
    def interaction(self, law: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return force, torques and new memory of one law between listed pair m; nothing where the two are of
        one rigid body, within which it does not act."""
        past = self.past(law, w, m)
        force, torque_i, torque_j, memory = law.interaction(
            self.s, w, i, j, separation, distance, past, self.elapsed_time(w), t
        )
        if ti.static(self.half_list.within_bodies and not law.within_bodies):
            # What a law returns of two that lie in each other need not be finite.
            apart = not self.half_list.joined(w, i, j)
            force, torque_i = ti.select(apart, force, 0.0), ti.select(apart, torque_i, 0.0)
            torque_j, memory = ti.select(apart, torque_j, 0.0), ti.select(apart, memory, 0.0)
        return force, torque_i, torque_j, memory

    @ti.func
    def past(self, law: ti.template(), w, m):  # type: ignore[valid-type]
        """Return what listed pair m remembers of one law; one 0 where that is nothing."""
        past = ti.Vector.zero(self.s.real, max(1, law.memory))
        if ti.static(law.memory > 0):
            past = law.past.read(w, m)
        return past

    @ti.func
    def pair_contributions(self, values):
        force = piece(values, 0, 3)
        here, there = self.wrench(force, force), self.wrench(-force, force)
        if ti.static(self.turning):
            here = self.wrench(force, piece(values, 3, 3))
            there = self.wrench(-force, piece(values, 6, 3))
        separation = 0.0 * force
        if ti.static(self.has_virial):
            separation = piece(values, self.separation_begin, 3)
        return self.summand(here, separation), self.summand(there, -separation)

    @ti.func
    def write_memory(self, w, m, values):
        if self.updates_memory(w):
            for law, begin in ti.static(self.remembering):
                law.past.write(w, m, piece(values, begin, law.memory))

    @ti.func
    def elapsed_time(self, w):
        """Return the time (s) since what particles remember was last brought up to date."""
        s, now = self.s, self.s.occasion[w]
        none = now == Occasion.START or now == Occasion.AFTER_EVENTS
        step = ti.select(now == Occasion.AHEAD, s.step_ahead[w], s.dt[w])
        return ti.cast(ti.select(none, 0.0, step), s.real)

    @ti.func
    def updates_memory(self, w):
        """Return whether what particles remember is brought up to date with this sum."""
        updates = False
        if ti.static(self.commits):
            occasion = self.s.occasion[w]
            updates = occasion == Occasion.STEP or occasion == Occasion.START
        return updates

    @ti.func
    def out_of_reach(self, w, m):
        if self.updates_memory(w):
            for effect in ti.static(self.short_ranged):
                if ti.static(effect.memory > 0):
                    effect.past.forget(w, m)

    @ti.func
    def is_free(self, w, i):
        """Return whether forces may move i."""
        free = True
        if ti.static(self.has_fixed):
            free = self.s.fixed[w, i] == 0
        return free

    @ti.func
    def write(self, w, i, total):
        s = self.s
        for k in ti.static(range(3)):
            s.force[w, i][k] = total[k]
            if ti.static(self.turning):
                s.torque[w, i][k] = total[3 + k]
        if ti.static(self.has_virial):
            for k in ti.static(range(VIRIAL.slots)):
                s.virial[w, i, k] = total[self.load_size + k]

    @ti.func
    def check(self, w, i, total):
        if not finite(total.norm_sqr()):
            if self.s.occasion[w] == Occasion.AHEAD:
                # The law at fault is found by a sum over the step.
                self.s.dt[w] = self.s.step_ahead[w]
            self.s.fail_by_force(w, WorldStatus.NOT_FINITE, i)

    @ti.func
    def load_by(self, effect: ti.template(), w, i, t):  # type: ignore[valid-type]
        """Return the force on i by one law that no other particle exerts, with its torque."""
        force, torque = effect.load(self.s, w, i, t, self.elapsed_time(w), self.updates_memory(w))
        return self.wrench(force, torque)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        load = self.wrench(
            effect.pair_force(s, w, i, j, separation, distance, t),
            effect.pair_torque(s, w, i, j, separation, distance, t),
        )
        return self.summand(load, separation)

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        return effect.pair_force_by_inverse(self.s, w, i, j, separation, inverse, t)


class SumTrialForces(SumForces):
    """This phase sums the forces of a trial state, which may be one that is to be given up: whatever is not
    finite may stay."""

    trial, commits = True, False

    @ti.func
    def check(self, w, i, total):
        pass
