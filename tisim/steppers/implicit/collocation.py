"""The implicit stepper of high order: Lobatto's collocation, of which the papers' trapezoid is the first."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

from tisim.components.accuracy_parameter import three_digits
from tisim.components.component import option
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.forces.loads import FORCE
from tisim.program.block_sum import BlockSums
from tisim.program.phases import Item
from tisim.state.fields import Field
from tisim.steppers.base import Stepper
from tisim.steppers.common import AdvanceClock, apply_operators, report_displacement
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.implicit.attempts import Begin, Decide, RestoreState, SaveState, StepAttempt
from tisim.steppers.implicit.collocation_phases import (
    ChooseCollocationStep,
    Conclude,
    Forget,
    Place,
    PredictStages,
    StageSweep,
    TakeStages,
)
from tisim.steppers.implicit.collocation_verdict import JudgeStages
from tisim.steppers.implicit.excursion import NoteExcursion, excursion_fields
from tisim.steppers.implicit.saved_state import CHANGE, saved_fields
from tisim.steppers.implicit.stage_control import StageControl
from tisim.steppers.implicit.stages import Stages


class Collocation(Stepper):
    """Lobatto's collocation advances time implicitly, with order 2s - 2 for s stages.

        v_i = v + dt sum_j a_ij v'_j,    r_i = r + dt sum_j a_ij v_j,    v'_j = F_j/m

    It is symmetric, as the trapezoidal rule is, which it is for s = 2. The equations are solved by sweeps
    over the stages, each with what is newest of the others. The first sweep starts from the polynomial of the
    last step; what it turns out to be off at one stage tells what it is off at the later ones, so that one or
    two sweeps are enough: some s - 1 to 2 (s - 1) force evaluations for a step. The part of the force that is
    linear in velocity is solved exactly with each stage. Spin is stepped as velocity is. What the first sweep
    starts from is made anew when there have been impacts.

    It pays where forces are smooth, the more so the more digits are wanted. Kinks and jumps of forces cost it
    its order: three stages are best there, and its control goes by a bound of the error (``StageControl``).
    For contacts a leapfrog is cheaper.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.5. Sweeps that
    start from the polynomial of the last step: E. Everhart, Celest. Mech. 10 (1974) 35-55, and H. Rein, D. S.
    Spiegel, MNRAS 446 (2015) 1424-1437, both for Radau's stages.
    """

    stages: int = option("number s of stages; the order is 2s - 2", 5, ge=3, le=8)
    control: StageControl = option("step control", StageControl())

    counters: ClassVar = ("rejections", "solver_iterations", "force_evaluations")
    world_quantities: ClassVar = (
        *("time_before", "next_dt", "last_dt", "measured_dt"),
        *("stage_change", "last_change", "contraction"),
    )
    flags: ClassVar = ("attempting", "verdict", "sweeping", "sweep", "stage", "out_of_range")

    @property
    def order(self) -> int:
        return 2 * self.stages - 2

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        forced = any(isinstance(effect, Force | PairForce) for effect in effects)
        shortest = min(1e-12, three_digits(1e-3 * dt))
        smooth = all(effect.smooth for effect in effects)
        return (cls(control=StageControl(first=dt, shortest=shortest)),) if forced and smooth else ()

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        return work["force_evaluations"]

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        turns = turning(effects)
        return (
            FORCE,
            *saved_fields(turns),
            CHANGE,
            *excursion_fields(self.control.at_end),
            *Stages.fields(self.stages, turns),
        )

    def step(self, context: StepContext) -> Step:
        stages, sums = Stages(context, self.stages), BlockSums(context.s, 4)
        report, forces = report_displacement(context), (*context.update_lists, *context.sum_trial_forces)
        take = (TakeStages(context, sums, stages), JudgeStages(context, sums, stages))
        sweep = StageSweep(context, (Place(stages), *report, *forces, *take))
        attempt: tuple[Item, ...] = (
            ChooseCollocationStep(context, stages),
            PredictStages(stages),
            sweep,
            Conclude(stages),
            RestoreState(stages),
            *report,
            Decide(context),
        )
        begin = (Forget(context), Begin(context), SaveState(context, stages))
        note = (NoteExcursion(stages),) if self.control.at_end else ()
        end = (*note, *context.advance_memory, *apply_operators(context), AdvanceClock(context))
        return Step(
            (*begin, StepAttempt(context, attempt), *end),
            (
                Buffer(stages, "coefficients of the stages", self.kind()),
                Buffer(sums, "sums of the stages", self.kind()),
            ),
        )
