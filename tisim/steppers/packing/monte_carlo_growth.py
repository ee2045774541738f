"""Random packings of hard bodies that grow while they move at random."""

from collections.abc import Sequence
from math import sqrt
from typing import Any, ClassVar, Self

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.effects.base import Effect, HardBodies
from tisim.numerics import philox
from tisim.numerics.random_streams import TRIAL_MOVES
from tisim.pairs.listed_pairs import sum_phases
from tisim.pairs.pair_sum import ListedLaws
from tisim.program.phases import PerParticle, Phase
from tisim.program.scans import BlockSums
from tisim.state.bound import Bound
from tisim.state.fields import Field, WorldField
from tisim.state.state import State
from tisim.state.status import WorldStatus
from tisim.steppers.common import BeginStep
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.packing.overlaps import BodySum
from tisim.steppers.packing.packing_stepper import (
    PACKING_FIELDS,
    BeginAttempt,
    MoveBodies,
    PackingStepper,
    SumVolumes,
    rotated_by,
)
from tisim.steppers.packing.space import CheckWidth
from tisim.steppers.verlet import Advance

CONFLICT = Field("trial_conflict", "", 1, "keep", scratch=True)
"""1 if a body cannot make its trial move, else 0."""
CROWDING = Field("crowding", "", 1, "keep", scratch=True)
"""1 over the least factor, less 1, by which a body and one of its neighbours may grow."""
OVERLAP_FLAG = Field("overlap_flag", "", 1, "keep", scratch=True)
"""1 if a body overlaps another one, else 0."""
LONGEST_TRIAL, TRIAL_CHANGE = 0.1, 1.02
"""The longest trial move (D), and the factor by which a step changes the length of trial moves."""
TRIAL_SKIN = 3.0
"""Skin of the pair list over the distance by which trial moves may bring two bodies closer."""


class MonteCarloGrowth(PackingStepper):
    """Monte Carlo growth packs hard bodies that move at random and grow until they have no room to move.

    A step is a trial move of all bodies at once. Each is displaced by a random vector and turned by another
    one, both uniform in a cube; its side is l D for the displacement, and for the rotation such that the
    surface moves as far. Bodies i and j, with gap g in the present state, do not move if

        min(g_ij', g_i'j, g_i'j') < min(0, g_ij)

    where a prime stands for the state after the trial move. This rule is the same for the reverse move, so
    there is detailed balance: bodies of constant size sample all configurations without overlaps with equal
    weight. The length l is adjusted such that a fraction ``acceptance`` of the moves is accepted.

    In the same step the bodies grow, by ``rate`` l D in the radius of the largest one, or by half of the room
    between the two closest bodies if that is less. Bodies never overlap, unless they do so at the start;
    such overlaps can only decrease, and are removed before bodies grow. As l is the room between bodies,
    ``rate`` has the meaning of the growth rate of Lubachevsky and Stillinger, a speed of growth over a
    thermal speed.

    A world ends when l is below ``precision``, and fails if there are still overlaps of the start then. The
    measure ``packing_fraction`` of the result is its density. One step takes the time ``dt`` of the control,
    so the duration of a run is the largest number of steps.

    Source: B. D. Lubachevsky, F. H. Stillinger, J. Stat. Phys. 60 (1990) 561, for growth at a rate;
    docs/packings.md for the rule of the moves.

    Walls are not followed; the box must be periodic.
    """

    rate: float = parameter(
        "", "growth of the radius in a step over the length of trial moves", 0.1, gt=0, le=1
    )
    precision: float = parameter("D", "length of trial moves below which a world ends", 1e-4, gt=0)
    acceptance: float = parameter("", "fraction of trial moves that are accepted", 0.2, gt=0, lt=1)

    # Slow growth leaves time for order, so there is no limit of random packings.
    accuracy_parameters: ClassVar = (
        AccuracyParameter(precision=1, converges=False),
        AccuracyParameter(rate=1, converges=False),
    )
    random: ClassVar = True
    confines: ClassVar = False
    world_fields: ClassVar = (
        *PACKING_FIELDS,
        WorldField("accepted_moves", "sum"),
        WorldField("packing_fraction", "measure"),
        WorldField("trial_length", "real"),
        WorldField("trial_reach", "real", "m"),
        WorldField("largest_radius", "real", "m"),
        WorldField("least_room", "real"),
    )

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        return (cls(precision=1e-3),) if any(isinstance(effect, HardBodies) for effect in effects) else ()

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        return (CONFLICT, CROWDING, OVERLAP_FLAG)

    def step(self, context: StepContext) -> Step:
        (bodies,) = context.effects.of(HardBodies)
        trials, sums = TrialStates(context.s), BlockSums(context.s, 1)
        conflicts = SumConflicts(context, bodies, trials)
        shared = conflicts.exported()
        items = (
            MeasureBodies(context.s),
            ListTrials(context, bodies),
            *context.update_lists,
            BeginAttempt(context),
            ProposeMoves(context, bodies, trials),
            *sum_phases(conflicts, shared),
            SumVolumes(sums, bodies),
            GrowBodies(context, bodies, sums),
            BeginStep(context),
            MakeMoves(context, bodies, trials),
            CheckWidth(context),
            Advance(context),
        )
        buffers = (
            Buffer(trials, "states after trial moves", self.kind()),
            Buffer(shared, "conflicts between chunks", self.kind()),
            Buffer(sums, "sums over bodies", self.kind()),
        )
        return Step(items, buffers)


@ti.data_oriented
class TrialStates:
    """Trial states hold each body twice: i is the present state, and i + capacity the state after its trial
    move. Hard bodies read them as they read the state."""

    def __init__(self, s: State) -> None:
        self.capacity, self.real = s.capacity, s.real
        self.radius, self.shape, self.orientation = ti.field(s.real), ti.field(ti.i32), ti.field(s.real)
        self.shift, self.turn = ti.Vector.field(3, s.real), ti.Vector.field(3, s.real)
        builder = Builder()
        both = builder.dense(ti.i, s.worlds).dense(ti.j, 2 * s.capacity)
        both.place(self.radius, self.shape)
        builder.dense(ti.i, s.worlds).dense(ti.j, 2 * s.capacity).dense(ti.k, 4).place(self.orientation)
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.shift, self.turn)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes

    @ti.func
    def reach(self, s, w, i):
        """Return the gap (m) that trial moves of two bodies may close."""
        return ti.cast(s.trial_reach[w], s.real)


class MeasureBodies(PerParticle):
    """This phase finds the largest radius, before the first step."""

    conditional = True

    @ti.func
    def when(self, w):
        return ti.cast(self.s.steps[w] == 0, ti.i32)

    @ti.func
    def run(self, w, i):
        ti.atomic_max(self.s.largest_radius[w], ti.cast(self.s.radius[w, i], ti.f64))


class ListTrials(Phase):
    """This phase sets the range of trial moves, and has lists rebuilt that may lack a pair within it."""

    def __init__(self, context: StepContext, bodies: Any) -> None:
        assert context.neighbour_lists is not None
        assert context.neighbour_lists.pairs is not None
        self.s, self.bodies, self.stepper = context.s, bodies, context.stepper
        self.lists = context.neighbour_lists
        self.half_list = context.neighbour_lists.pairs.half_list

    @ti.func
    def run(self, w, _k):
        s = self.s
        if s.steps[w] == 0:
            s.trial_length[w] = LONGEST_TRIAL
        size = ti.cast(self.bodies.size(s, w, 0) * self.bodies.unit(w, 0), ti.f64)
        # The centre and the surface of a body move by at most half the diagonal of a cube each.
        farthest = ti.static(sqrt(3)) + ti.cast(self.stepper.rate(w), ti.f64)
        s.trial_reach[w] = 2.0 * farthest * s.trial_length[w] * size
        s.skin[w] = TRIAL_SKIN * s.trial_reach[w]
        square = ti.cast(0.0, ti.f64)
        for k in ti.static(range(3)):
            square += self.half_list.since[w, k] ** 2
        if not (2.0 * ti.sqrt(square) + s.trial_reach[w] <= self.half_list.grid.skin[w, 0]):
            self.lists.invalidate(w)
        s.accepted_moves[w], s.least_room[w] = 0, ti.math.inf


class ProposeMoves(PerParticle):
    """This phase draws the trial moves."""

    def __init__(self, context: StepContext, bodies: Any, trials: TrialStates) -> None:
        super().__init__(context.s)
        self.bodies, self.trials = bodies, trials

    @ti.func
    def run(self, w, i):
        s = self.s
        size = self.bodies.size(s, w, 0) * self.bodies.unit(w, 0)
        length = ti.cast(s.trial_length[w], s.real) * size
        shift, turn = length * self.uniform(w, i, 0), length / s.radius[w, i] * self.uniform(w, i, 2)
        self.trials.shift[w, i], self.trials.turn[w, i] = shift, turn
        before = self.bodies.turn(s, w, i)
        after = rotated_by(turn, before)
        for state in ti.static(range(2)):
            k = i + state * self.trials.capacity
            self.trials.radius[w, k], self.trials.shape[w, k] = s.radius[w, i], s.shape[w, i]
        for c in ti.static(range(4)):
            self.trials.orientation[w, i, c] = before[c]
            self.trials.orientation[w, i + self.trials.capacity, c] = after[c]

    @ti.func
    def uniform(self, w, i, draw: ti.template()):  # type: ignore[valid-type]
        """Return a vector, uniform in a cube of side 1 around 0."""
        s = self.s
        u = philox.uniform(philox.bits(s.seed[w], TRIAL_MOVES, s.id[w, i], s.steps[w], draw))
        v = philox.uniform(philox.bits(s.seed[w], TRIAL_MOVES, s.id[w, i], s.steps[w], draw + 1))
        return ti.cast(ti.Vector([u[0], u[1], v[0]]) - 0.5, s.real)


class SumConflicts(BodySum):
    """This sum finds the bodies that cannot make their trial moves, and those that overlap."""

    components = 3

    def __init__(self, context: StepContext, bodies: Bound[Any], trials: TrialStates) -> None:
        super().__init__(context, bodies)
        self.trials = trials

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        listed = ListedLaws(laws, 3, False)
        listed.reaching = (self.trials,)
        return listed

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        here, there = separation - self.trials.shift[w, i], separation + self.trials.shift[w, j]
        moved_i, moved_j = i + self.trials.capacity, j + self.trials.capacity
        gap, room = self.gap(w, i, j, separation)
        gap_i, room_i = self.gap(w, moved_i, j, here)
        gap_j, room_j = self.gap(w, i, moved_j, there)
        gap_both, room_both = self.gap(w, moved_i, moved_j, here + self.trials.shift[w, j])
        conflict = ti.min(ti.min(gap_i, gap_j), gap_both) < ti.min(gap, 0.0)
        # Either body may be kept in place by others.
        room = ti.select(conflict, room, ti.min(ti.min(room, room_i), ti.min(room_j, room_both)))
        crowding = 1.0 / ti.select(room > 0.0, room, 1.0)
        return ti.Vector(
            [ti.select(conflict, 1.0, 0.0), crowding, ti.select((gap < 0.0) | (room <= 0.0), 1.0, 0.0)]
        )

    @ti.func
    def gap(self, w, i, j, separation):
        """Return the gap (m) between two bodies in the present state or after trial moves, and the relative
        growth of both that closes it at most."""
        size = self.bodies.size(self.s, w, 0) * self.bodies.unit(w, 0)
        # A wider gap does not limit the growth of a step.
        far = 4.0 * self.stepper.rate(w) * ti.cast(self.s.trial_length[w], self.s.real) * size
        turn_i, turn_j = self.bodies.turn(self.trials, w, i), self.bodies.turn(self.trials, w, j)
        gap, normal, _here, _there = self.bodies.between(
            self.trials, w, i, j, turn_i, turn_j, separation, far
        )
        # The extents of both bodies along the normal, which grow in proportion.
        extent = separation.dot(normal) - gap
        return gap, gap / ti.select(extent > 0.0, extent, 1.0)

    @ti.func
    def pair_contributions(self, values):
        return values, values

    @ti.func
    def combine(self, a, b):
        return ti.max(a, b)

    @ti.func
    def write_sum(self, w, i, total):
        s = self.s
        s.trial_conflict[w, i], s.crowding[w, i], s.overlap_flag[w, i] = total[0], total[1], total[2]

    @ti.func
    def read_sum(self, w, i):
        s = self.s
        return ti.Vector([s.trial_conflict[w, i], s.crowding[w, i], s.overlap_flag[w, i]])

    @ti.func
    def finish(self, w, i, total, t):
        s = self.s
        self.write_sum(w, i, total)
        if total[0] == 0.0:
            ti.atomic_add(s.accepted_moves[w], ti.i64(1))
        if total[1] > 0.0:
            ti.atomic_min(s.least_room[w], ti.cast(1.0 / total[1], ti.f64))
        if total[2] > 0.0:
            ti.atomic_add(s.overlapping[w], ti.i64(1))


class GrowBodies(Phase):
    """This phase chooses the growth of a step and the length of the next trial moves."""

    def __init__(self, context: StepContext, bodies: Any, sums: BlockSums) -> None:
        self.s, self.stepper, self.bodies, self.sums = context.s, context.stepper, bodies, sums
        self.domain, self.control = context.domain, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        length, side = s.trial_length[w], ti.cast(self.domain.side(w), ti.f64)
        last = s.end[w] - s.time[w] <= ti.cast(1.5, ti.f64) * ti.cast(self.control.dt(w), ti.f64)
        finest = length < ti.cast(self.stepper.precision(w), ti.f64)
        s.growth[w] = 1.0
        if s.overlapping[w] == 0:
            size = ti.cast(self.bodies.size(s, w, 0) * self.bodies.unit(w, 0), ti.f64)
            most = ti.cast(self.stepper.rate(w), ti.f64) * length * size / s.largest_radius[w]
            growth = 1.0 + ti.min(most, 0.5 * s.least_room[w])
            if finest:
                s.end[w], s.jammed[w] = s.time[w] + ti.cast(self.control.dt(w), ti.f64), 1
            else:
                s.growth[w] = growth
        elif finest or last:
            s.fail(w, WorldStatus.OVERLAPPING, 0)
        s.largest_radius[w] = s.largest_radius[w] * s.growth[w]
        volume = self.sums.total(w)[0] * s.growth[w] ** 3
        s.packing_fraction[w] = volume / (side[0] * side[1] * side[2])
        aim = ti.cast(self.stepper.acceptance(w), ti.f64) * s.count[w]
        change = ti.select(ti.cast(s.accepted_moves[w], ti.f64) > aim, TRIAL_CHANGE, 1.0 / TRIAL_CHANGE)
        s.trial_length[w] = ti.min(length * change, LONGEST_TRIAL)


class MakeMoves(MoveBodies):
    """This phase makes the trial moves without a conflict."""

    def __init__(self, context: StepContext, bodies: Any, trials: TrialStates) -> None:
        super().__init__(context, bodies)
        self.trials = trials

    @ti.func
    def motion(self, w, i):
        shift, turn = self.trials.shift[w, i], self.trials.turn[w, i]
        moves = self.s.trial_conflict[w, i] == 0.0
        return ti.select(moves, shift, 0.0 * shift), ti.select(moves, turn, 0.0 * turn)
