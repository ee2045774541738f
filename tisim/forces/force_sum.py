"""The sum of forces and torques on every particle, and the contact history after steps found by trial."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.loads import Loads
from tisim.numerics.ieee import finite
from tisim.numerics.roots import estimates_roots
from tisim.numerics.vectors import piece
from tisim.pairs.listed_pairs import ComputePairs, ExportedTerms
from tisim.pairs.pair_sum import ListedLaws, PairSum
from tisim.program.evaluation_stage import EvaluationStage
from tisim.program.phases import PerParticle, Phase
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.pairs.pair_chunks import PairChunks
    from tisim.state.bound import Bound, Peers
    from tisim.state.state import State


def turning(effects: Sequence[Effect]) -> bool:
    """Return whether any of these effects exerts torques."""
    return any(effect.turns(effects) for effect in effects if isinstance(effect, Force | PairForce))


class SumForces(PairSum):
    """This phase sets force[w, i] to the sum of the forces of the scene on i, in a fixed order: external
    forces, all pairs, listed pairs.

    If an effect exerts torques, force and torque are summed as one vector of six, the load. A particle that
    is ``fixed``, in a scene with this field, gets no load. In a scene with the field ``virial``, nine more
    components are summed: the half of the pair virial that belongs to i. The sum also updates the contact
    history.

    trial : whether the state is a trial state that may be rejected.
    commits : whether this sum may update the contact history.
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
        self.loads = Loads(s, self.turning)
        self.components = self.loads.components
        # Values of a listed pair: force, torques on both particles, the separation if it is needed, and the
        # history of each law.
        self.separation_begin = 9 if self.turning else 3
        self.remembers = any(
            effect.data.offers("load" if isinstance(effect.data, Force) else "interaction")
            for effect in (*self.forces, *self.pair_forces)
        )
        able = all(effect.data.offers_inverse() for effect in self.long_ranged)
        self.by_inverse = able and not self.turning and not self.loads.virial and estimates_roots()

    @ti.func
    def start(self, w, i, t):
        return self.loads.summand(self.external_load(w, i, t), 0.0 * self.s.position[w, i])

    @ti.func
    def finish(self, w, i, total, t):
        taken = total
        if ti.static(self.has_fixed):
            for k in ti.static(range(self.loads.size)):
                taken[k] = ti.select(self.is_free(w, i), total[k], 0.0)
        self.loads.write(self.s, w, i, taken)
        self.check(w, i, taken)

    @ti.func
    def single_particle(self, w, i, t):
        """Set the force on i at its own time, for particles that do not interact."""
        for solver in ti.static(self.derived_solvers):
            solver.set(self.s, w, i, t)
        self.loads.write(self.s, w, i, self.external_load(w, i, t))

    @ti.func
    def external_load(self, w, i, t):
        """Return the sum of the external forces on i, with their torques."""
        s = self.s
        total = self.loads.wrench(0.0 * s.velocity[w, i], 0.0 * s.velocity[w, i])
        if self.is_free(w, i):
            for effect in ti.static(self.forces):
                total += self.load_by(effect, w, i, t)
        return total

    @ti.func
    def write_sum(self, w, i, total):
        self.loads.write(self.s, w, i, total)

    @ti.func
    def read_sum(self, w, i):
        return self.loads.read(self.s, w, i)

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        return ListedLaws(laws, self.separation_begin + (3 if self.loads.virial else 0), self.commits)

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        values = ti.Vector.zero(self.s.real, laws.values)
        for law, begin in ti.static(laws.placed):
            force, torque_i, torque_j, memory = self.interaction(law, w, m, i, j, separation, distance, t)
            for k in ti.static(range(3)):
                values[k] += force[k]
                if ti.static(self.turning):
                    values[3 + k] += torque_i[k]
                    values[6 + k] += torque_j[k]
            if ti.static(self.commits):
                for k in ti.static(range(law.memory)):
                    values[begin + k] = memory[k]
        if ti.static(self.loads.virial):
            for k in ti.static(range(3)):
                values[self.separation_begin + k] = separation[k]
        return values

    @ti.func
    def interaction(self, law: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return force, torques and new contact history of one law for listed pair m.

        All are zero within a rigid body if the law does not act there.
        """
        past = self.past(law, w, m)
        force, torque_i, torque_j, memory = law.interaction(
            self.s, w, i, j, separation, distance, past, self.elapsed_time(w), t
        )
        if ti.static(self.half_list.within_bodies and not law.within_bodies):
            # For overlapping particles of a body the results of a law may not be finite.
            apart = not self.half_list.joined(w, i, j)
            force, torque_i = ti.select(apart, force, 0.0), ti.select(apart, torque_i, 0.0)
            torque_j, memory = ti.select(apart, torque_j, 0.0), ti.select(apart, memory, 0.0)
        return force, torque_i, torque_j, memory

    @ti.func
    def past(self, law: ti.template(), w, m):  # type: ignore[valid-type]
        """Return the contact history of listed pair m for one law; a single 0 if it has none."""
        past = ti.Vector.zero(self.s.real, max(1, law.memory))
        if ti.static(law.memory > 0):
            past = law.past.read(w, m)
        return past

    @ti.func
    def pair_contributions(self, values):
        force, loads = piece(values, 0, 3), self.loads
        here, there = loads.wrench(force, force), loads.wrench(-force, force)
        if ti.static(self.turning):
            here = loads.wrench(force, piece(values, 3, 3))
            there = loads.wrench(-force, piece(values, 6, 3))
        separation = 0.0 * force
        if ti.static(loads.virial):
            separation = piece(values, self.separation_begin, 3)
        return loads.summand(here, separation), loads.summand(there, -separation)

    @ti.func
    def write_memory(self, laws: ti.template(), w, m, values):  # type: ignore[valid-type]
        if self.updates_memory(w):
            for law, begin in ti.static(laws.remembering):
                law.past.write(w, m, piece(values, begin, law.memory))

    @ti.func
    def elapsed_time(self, w):
        """Return the time (s) since contact history and particle memory were last updated."""
        s, now = self.s, self.s.evaluation_stage[w]
        none = now == EvaluationStage.START or now == EvaluationStage.AFTER_EVENTS
        step = ti.select(now == EvaluationStage.AHEAD, s.step_ahead[w], s.dt[w])
        return ti.cast(ti.select(none, 0.0, step), s.real)

    @ti.func
    def updates_memory(self, w):
        """Return whether this sum updates the contact history."""
        updates = False
        if ti.static(self.commits):
            evaluation_stage = self.s.evaluation_stage[w]
            updates = evaluation_stage == EvaluationStage.STEP or evaluation_stage == EvaluationStage.START
        return updates

    @ti.func
    def out_of_reach(self, laws: ti.template(), w, m):  # type: ignore[valid-type]
        if self.updates_memory(w):
            for law, _begin in ti.static(laws.remembering):
                law.past.forget(w, m)

    @ti.func
    def is_free(self, w, i):
        """Return whether forces may move i."""
        free = True
        if ti.static(self.has_fixed):
            free = self.s.fixed[w, i] == 0
        return free

    @ti.func
    def check(self, w, i, total):
        if not finite(total.norm_sqr()):
            if self.s.evaluation_stage[w] == EvaluationStage.AHEAD:
                # The sum that finds the law at fault uses this step.
                self.s.dt[w] = self.s.step_ahead[w]
            self.s.fail_by_force(w, WorldStatus.NOT_FINITE, i)

    @ti.func
    def load_by(self, effect: ti.template(), w, i, t):  # type: ignore[valid-type]
        """Return the external force on i by one law, with its torque."""
        force, torque = effect.load(self.s, w, i, t, self.elapsed_time(w), self.updates_memory(w))
        return self.loads.wrench(force, torque)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        s = self.s
        load = self.loads.wrench(
            effect.pair_force(s, w, i, j, separation, distance, t),
            effect.pair_torque(s, w, i, j, separation, distance, t),
        )
        return self.loads.summand(load, separation)

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        return effect.pair_force_by_inverse(self.s, w, i, j, separation, inverse, t)


class SumTrialForces(SumForces):
    """This phase sums the forces of a trial state that may be rejected; values that are not finite cause no
    failure."""

    trial, commits = True, False

    @ti.func
    def check(self, w, i, total):
        pass


class AdvanceParticles(PerParticle):
    """This phase updates the memory of single particles after a step found by trial."""

    def __init__(self, total: SumForces) -> None:
        super().__init__(total.s)
        self.total = total

    @ti.func
    def run(self, w, i):
        self.total.external_load(w, i, self.s.time[w])


def advance_phases(total: SumForces, exported: ExportedTerms) -> tuple[Phase, ...]:
    """Return the phases that update the contact history."""
    return tuple(AdvancePairs(total, exported, laws) for laws in total.listed_laws() if laws.remembering)


class AdvancePairs(ComputePairs):
    """This phase updates the contact history after a step found by trial."""

    @ti.func
    def run(self, w, c):
        self.note_memory(w)
        self.compute_pairs(w, c)

    @ti.func
    def process_pair(self, w, c, m, values):
        self.total.write_memory(self.laws, w, m, values)

    @ti.func
    def process_distant_pair(self, w, c, m):
        self.total.out_of_reach(self.laws, w, m)
