"""The adaptive implicit stepper of Z13 (appendix) and Z16 (section 8, appendix C)."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import three_digits
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.forces.loads import FORCE
from tisim.program.phases import Item, PerParticle, Phase, Repeat
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.fields import Field, WorldField
from tisim.steppers.base import Stepper
from tisim.steppers.common import (
    CHANGE,
    AdvanceClock,
    apply_operators,
    note_displacement,
    saved_fields,
)
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.implicit.anderson import accelerated, memory_of_iterates
from tisim.steppers.implicit.attempts import (
    ATTEMPTS,
    SHORTER,
    Begin,
    Decide,
    RestoreState,
    SaveState,
    StepAttempt,
    conclude,
    length,
    relative,
    report_trial,
)
from tisim.steppers.implicit.one_particle import IndependentSteps, Solve
from tisim.steppers.implicit.step_control import (
    ErrorControl,
    IterationControl,
    NoteExcursion,
    excursion_fields,
)
from tisim.steppers.intervals import (
    INTERVALS,
    OWN_CLOCK,
    BeginIntervals,
    EndIntervals,
)

OWN_STEP_FIELDS = (Field("own_dt", "s", 1, "keep", scratch=True), *OWN_CLOCK)
"""The fields of a particle that takes steps of its own: the length of the next step, and its clock."""


class Trapezoid(Stepper):
    """The implicit trapezoidal rule advances time; its equations are solved by fixed-point iteration.

        v' = v + dt/m (phi F' + (1 - phi) F),    r' = r + dt (phi v' + (1 - phi) v),    spin as v

    F' is the force at the end of the step. Each iterate is computed with the force at the positions,
    velocities and spins of the last iterate; the first is computed with F. Each world has its own step,
    iterations and end.

    The part of the force that is linear in velocity, for effects that define ``velocity_jacobian``, is solved
    exactly with each iterate. Anderson's acceleration forms each iterate from the last two. It needs fewer
    iterates, and may converge when plain iteration does not. Particles that do not interact take their own
    steps and meet at every multiple of ``control.longest``; a step of the world is then such an interval.

    Source: Z13 (A1)-(A10); Z16 (8.4), (C.1)-(C.5).
    """

    phi: float = parameter(
        "",
        "weight phi of the end of a step: 1/2 for second order, 1 for implicit Euler, 0 for explicit Euler",
        0.5,
        ge=0,
        le=1,
    )
    control: IterationControl = option("step control", IterationControl())
    acceleration: Literal["none", "anderson"] = option("acceleration of the fixed-point iteration", "none")

    world_fields: ClassVar = (
        *ATTEMPTS,
        *INTERVALS,
        WorldField("iterating", "integer"),
        WorldField("solver_iteration", "integer"),
    )

    @property
    def order(self) -> int:
        return 2 if self.phi == 0.5 else 1

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        forced = any(isinstance(effect, Force | PairForce) for effect in effects)
        if not forced or not all(effect.smooth for effect in effects):
            return ()
        limits = {"first": dt, "longest": dt, "shortest": min(1e-12, three_digits(1e-3 * dt))}
        papers = IterationControl(tolerance=1e-6, **limits)
        own = ErrorControl(error=1e-4, tolerance=1e-5, **{**limits, "longest": three_digits(1e3 * dt)})
        tried = (cls(control=papers), cls(phi=1.0, control=papers))
        if any(isinstance(effect, PairForce) for effect in effects):
            return (cls(control=own), cls(control=own, acceleration="anderson"), *tried)
        # Particles that do not interact are stepped by explicit Euler in Z16 (6.1).
        return (cls(control=own), *tried, cls(phi=0.0, control=papers))

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        return work["force_evaluations"] / (particles if independent else 1)

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        if self.independent(effects):
            return (FORCE, *OWN_STEP_FIELDS, *excursion_fields(self.control.at_end))
        turns, accelerated = turning(effects), self.acceleration == "anderson"
        more = (*excursion_fields(self.control.at_end), *(memory_of_iterates(turns) if accelerated else ()))
        return (FORCE, *saved_fields(turns), CHANGE, *more)

    def step(self, context: StepContext) -> Step:
        s, solve = context.s, Solve(context, context.stepper.phi)
        if context.independent:
            return Step((BeginIntervals(context), IndependentSteps(context, solve), EndIntervals(context)))
        sums = BlockSums(s, 4)
        report, forces = report_trial(context), (*context.update_lists, *context.sum_trial_forces)
        buffers: tuple[Buffer, ...] = (Buffer(sums, "sums of the iteration", self.kind()),)
        if self.acceleration == "anderson":
            mixing = BlockSums(s, 2)
            forces = accelerated(context, forces, mixing)
            buffers += (Buffer(mixing, "sums of the acceleration", self.kind()),)
        judge = JudgeIteration(context, sums)
        iteration = Iteration(context, (*forces, Correct(context, sums, solve), *report, judge))
        attempt: tuple[Item, ...] = (
            ChooseTrapezoidStep(context),
            PredictEnd(solve),
            *report,
            iteration,
            RestoreState(solve),
            *report,
            Decide(context),
        )
        note = (NoteExcursion(solve),) if self.control.at_end else ()
        end = (*note, *context.advance_memory, *apply_operators(context), AdvanceClock(context))
        return Step((Begin(context), SaveState(context, solve), StepAttempt(context, attempt), *end), buffers)


class Iteration(Repeat):
    """This repeat computes iterates of an attempt, until there is a verdict."""

    usual = 2

    def __init__(self, context: StepContext, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.s = context.s

    @ti.func
    def pending(self, w):
        return self.s.iterating[w]


class ChooseTrapezoidStep(Phase):
    """This phase chooses the step, and sets the time to its end, at which forces are evaluated. The last step
    ends exactly at the end of the run."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.control = context.s, context.control

    @ti.func
    def run(self, w, _k):
        s = self.s
        dt = length(s, self.control, w)
        s.dt[w] = dt
        s.time[w] = s.time_before[w] + dt
        s.iterating[w], s.solver_iteration[w] = 1, 1


class PredictEnd(PerParticle):
    """This phase computes the first iterate, K = 1, with the force at the beginning of the step."""

    def __init__(self, solve) -> None:
        super().__init__(solve.s)
        self.solve = solve

    @ti.func
    def run(self, w, i):
        s, solve = self.s, self.solve
        dt = ti.cast(s.dt[w], s.real)
        v = solve.predict(w, i, dt, s.time[w])
        moved = ti.cast(solve.displacement(w, i, v, dt), ti.f64)
        note_displacement(s, w, moved - s.axes(s.frame, w) * s.dt[w])


class Correct(PerBlock):
    """This phase computes the next iterate, and sums the change, the displacement, the error, and the scale
    of the error (m)."""

    def __init__(self, context: StepContext, sums, solve) -> None:
        super().__init__(sums)
        self.control, self.solve = context.control, solve

    @ti.func
    def each(self, w, i):
        s, solve = self.s, self.solve
        dt = ti.cast(s.dt[w], s.real)
        last = s.velocity[w, i]
        v, turned = solve.correct(w, i, last, dt, solve.jacobian(w, i, s.time[w]))
        step = solve.phi(w) * dt * (v - last)
        change = step.norm() + turned
        note_displacement(s, w, ti.cast(step, ti.f64))
        s.iterate_change[w, i] = change
        moved, error, scale = solve.lengths(self.control, w, i, v, dt)
        return ti.cast(ti.Vector([change, moved, error, scale]), ti.f64)


class JudgeIteration(Phase):
    """This phase decides whether the iteration has converged, goes on, or is given up."""

    def __init__(self, context: StepContext, sums) -> None:
        self.s, self.control, self.sums = context.s, context.control, sums

    @ti.func
    def run(self, w, _k):
        s = self.s
        total = self.sums.total(w)
        change, error = relative(total[0], total[1]), relative(total[2], total[3])
        k = s.solver_iteration[w] + 1
        s.solver_iteration[w] = k
        s.solver_iterations[w] += 1
        s.force_evaluations[w] += 1
        if self.control.ends(w, change, k):
            accepted = self.control.solved(w, change) and self.control.accepts(w, error)
            factor = self.control.factor(w, self.control.aim(w), change, ti.cast(k, ti.f64), error)
            conclude(self.control, s, w, accepted, factor, SHORTER)
            s.iterating[w] = 0
