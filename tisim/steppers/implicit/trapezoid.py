"""The adaptive implicit stepper of Z13 (appendix) and Z16 (section 8, appendix C)."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

from tisim.components.accuracy_parameter import three_digits
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.forces.loads import FORCE
from tisim.program.block_sum import BlockSums
from tisim.program.phases import Item
from tisim.state.fields import Field
from tisim.steppers.base import Stepper
from tisim.steppers.common import AdvanceClock, apply_operators, report_displacement
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.implicit.anderson import accelerated, memory_of_iterates
from tisim.steppers.implicit.attempts import Begin, Decide, RestoreState, SaveState, StepAttempt
from tisim.steppers.implicit.excursion import NoteExcursion, excursion_fields
from tisim.steppers.implicit.independent import IndependentSteps
from tisim.steppers.implicit.one_particle import Solve
from tisim.steppers.implicit.saved_state import CHANGE, saved_fields
from tisim.steppers.implicit.step_control import ErrorControl, IterationControl
from tisim.steppers.implicit.trapezoid_phases import (
    ChooseTrapezoidStep,
    Correct,
    Iteration,
    JudgeIteration,
    PredictEnd,
)
from tisim.steppers.intervals import (
    INTERVAL_FLAGS,
    INTERVAL_QUANTITIES,
    OWN_CLOCK,
    BeginIntervals,
    EndIntervals,
)

OWN_STEP_FIELDS = (Field("own_dt", "s", 1, "keep", scratch=True), *OWN_CLOCK)
"""These are the fields of a particle that takes steps of its own: the length of the next one, and its
clock."""


class Trapezoid(Stepper):
    """The implicit trapezoidal rule advances time; its equations are solved by fixed-point iteration.

        v' = v + dt/m (phi F' + (1 - phi) F),    r' = r + dt (phi v' + (1 - phi) v),    spin as v

    F' is the force at the end of the step: each iterate is made with the force that positions, velocities and
    spins of the last one give, at the end of the step. The first one takes F itself. Each world has its own
    step, iterations and end.

    The part of the force that is linear in velocity, of effects that give ``velocity_jacobian``, is solved
    exactly with each iterate. Anderson's acceleration makes iterates from the last two, which converges in
    fewer of them, and where plain iteration does not. Particles that do not feel each other take their own
    steps and meet at every multiple of ``control.longest``; a step of the world is then such an interval.

    Source: Z13 (A1)-(A10); Z16 (8.4), (C.1)-(C.5).
    """

    phi: float = parameter(
        "",
        "weight phi of the end of a step: 1/2 of second order, 1 implicit Euler, 0 explicit",
        0.5,
        ge=0,
        le=1,
    )
    control: IterationControl = option("step control", IterationControl())
    acceleration: Literal["none", "anderson"] = option("how the iteration is accelerated", "none")

    counters: ClassVar = ("rejections", "solver_iterations", "force_evaluations")
    world_quantities: ClassVar = ("time_before", "next_dt", *INTERVAL_QUANTITIES)
    flags: ClassVar = ("attempting", "verdict", "iterating", "solver_iteration", *INTERVAL_FLAGS)

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
        pair_forces = any(isinstance(effect, PairForce) for effect in effects)
        accelerated = (cls(control=own, acceleration="anderson"),) if pair_forces else ()
        return (cls(control=own), *accelerated, cls(control=papers), cls(phi=1.0, control=papers))

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
        report, forces = report_displacement(context), (*context.update_lists, *context.sum_trial_forces)
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
