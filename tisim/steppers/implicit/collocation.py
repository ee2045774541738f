"""The implicit stepper of high order, Lobatto collocation, whose lowest order is the papers' trapezoidal
rule; and its step control, by an error estimate and the convergence of its sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter, three_digits
from tisim.components.component import option, parameter
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.forces.loads import FORCE
from tisim.numerics import elementary
from tisim.program.phases import Item
from tisim.program.scans import BlockSums
from tisim.state.fields import Field, WorldField
from tisim.steppers.base import Stepper
from tisim.steppers.common import CHANGE, AdvanceClock, apply_operators, saved_fields
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.implicit.attempts import (
    ATTEMPTS,
    Begin,
    Decide,
    RestoreState,
    SaveState,
    StepAttempt,
    report_trial,
)
from tisim.steppers.implicit.collocation_phases import (
    ChooseCollocationStep,
    Conclude,
    Forget,
    JudgeStages,
    Place,
    PredictStages,
    StageSweep,
    TakeStages,
)
from tisim.steppers.implicit.stages import Stages
from tisim.steppers.implicit.step_control import (
    LEAST_SAFETY,
    ImplicitControl,
    NoteExcursion,
    Per,
    error_scale,
    excursion_fields,
)
from tisim.steppers.step_control import SHORTEST_STEP

CONTRACTION = 0.25
"""Largest factor by which a sweep should multiply the error, if convergence limits the step."""


@ti.func
def eighth_powers(x):
    square = x * x
    return square * square * square * square


class StageControl(ImplicitControl):
    """The error of each collocation step meets a requested error, and its sweeps converge.

    The error is an error of position, for the sum over the particles or for each particle (``norm``). With
    per "step" it is a bound on the error of a step over the displacement in the step; the bound is usually
    far above the error itself. With per "run" it is the error at the end over the size of the motion,
    estimated for smooth forces by the leading term of the method's error. That term misses weak kinks, so for
    forces with kinks (``Effect.kinked``) the bound is used with per "run" too. For a particle that starts
    from rest the ratio of error and displacement would have no limit; the resolution prevents that.

    With ``per="run"`` the error at the end was 0.03 to 30 times the requested error in 13 scenes, and smaller
    under drag. With kinks it was up to 9 times the requested error for independent particles, and up to 70
    times for pairs at a cut-off (docs/steppers.md). Chaotic motion amplifies it without bound.

    With ``norm="each"`` the error of a particle is compared with its own motion, so that slow particles and
    small orbits are as accurate as large ones. The error of the world is the 8-norm of these ratios, which is
    at most N^(1/8) times the largest.

    Sweeps end once the change in the last sweep, times the contraction, is below ``part`` of the requested
    error. The contraction is the factor by which a sweep reduces the error. It is measured in the last two
    sweeps; in the first sweep it is extrapolated from earlier steps to the present step length.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Eqs (IV.8.10), (IV.8.11).
    """

    error: float = parameter("", "requested error of position, relative", 1e-6, gt=0)
    part: float = parameter("", "largest error when sweeps end, over the requested error", 0.3, gt=0)
    sweeps: int = option("largest number of sweeps in a step", 10, ge=2)
    safety: float = parameter(
        "",
        "safety factor of the length of the next step",
        0.85,
        ge=LEAST_SAFETY,
        lt=1,
    )
    resolution: float = parameter(
        "", "part of its radius that is added to a particle's displacement or size of motion", 1e-3, ge=0
    )
    per: Per = option(
        "reference of the error: the displacement in a step, or the size of the motion in the run", "step"
    )
    norm: Literal["sum", "each"] = option(
        "whether the error refers to the sum over the particles or to each particle", "sum"
    )
    first: float = parameter("s", "first trial step", 1e-6, ge=SHORTEST_STEP)
    longest: float = parameter("s", "longest step", 1.0, ge=SHORTEST_STEP)

    accuracy_parameters = (AccuracyParameter(error=1),)

    def asked(self) -> dict[str, float]:
        return {"error": self.error}

    @property
    def at_end(self) -> bool:
        return self.per == "run"

    def leading(self, smooth: bool) -> bool:
        """Return whether the error estimate is the leading term instead of the bound; for smooth forces
        only."""
        return self.at_end and smooth

    def order(self, stages: int, smooth: bool) -> int:
        """Return the power of dt with which the relative error estimate decreases."""
        return 2 * stages - 2 if self.leading(smooth) else stages

    @ti.func
    def scale(self, s, w, i, moved, dt):
        """Return the scale (m) of the error of a particle that has moved by ``moved`` (m) in a step of dt
        (s)."""
        return error_scale(self, s, w, i, moved, dt)

    @ti.func
    def terms(self, change, error, scale, rounding):
        """Return the terms (f64) of a particle in the sums over the world (m): the change of its motion in
        this sweep, its error, the scale of both, and their rounding error."""
        terms = ti.cast(ti.Vector([change, error, scale, rounding]), ti.f64)
        if ti.static(self.norm == "each"):
            terms = eighth_powers(terms / ti.cast(scale, ti.f64))
            terms[2] = 0.0
        return terms

    @ti.func
    def norms(self, total):
        """Return the norms over the world, given the sums of ``terms``."""
        norms = total
        if ti.static(self.norm == "each"):
            norms = ti.sqrt(ti.sqrt(ti.sqrt(total)))
            norms[2] = 1.0
        return norms

    @ti.func
    def solved(self, w, error):
        """Return whether sweeps may end with this remaining error."""
        return error <= ti.cast(self.part(w) * self.error(w), ti.f64)

    @ti.func
    def accepts(self, w, error):
        """Return whether a solved step is accurate enough."""
        return error <= ti.cast(self.error(w), ti.f64)

    @ti.func
    def factor(self, w, contraction, error, order):
        """Return the factor for the next step size: the error decreases as dt^order, the contraction as
        dt^2."""
        tolerance = ti.cast(self.error(w), ti.f64)
        target = ti.cast(self.safety(w), ti.f64) * elementary.pow(tolerance, 1.0 / order)
        by_error = self.limited(w, target, elementary.pow(error, 1.0 / order))
        return ti.min(by_error, self.limited(w, ti.sqrt(CONTRACTION), ti.sqrt(contraction)))


class Collocation(Stepper):
    """Lobatto collocation advances time implicitly, with order 2s - 2 for s stages.

        v_i = v + dt sum_j a_ij v'_j,    r_i = r + dt sum_j a_ij v_j,    v'_j = F_j/m

    It is symmetric; for s = 2 it is the trapezoidal rule. The equations are solved by sweeps over the stages,
    in which each stage uses the newest values of the others. The first sweep starts from the polynomial of
    the last step. The error of this prediction, once known at one stage, also corrects the later stages, so
    that one or two sweeps are enough: about s - 1 to 2 (s - 1) force evaluations per step. The part of the
    force that is linear in velocity is solved exactly with each stage. Spin is stepped as velocity is. After
    impacts the polynomial of the last step is discarded.

    Collocation pays for smooth forces, and more so for higher accuracy. Kinks and jumps of forces reduce its
    order: three stages are then best, and the control uses a bound on the error (``StageControl``). For
    contacts a leapfrog is cheaper.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.5. Sweeps that
    start from the polynomial of the last step: E. Everhart, Celest. Mech. 10 (1974) 35-55, and H. Rein, D. S.
    Spiegel, MNRAS 446 (2015) 1424-1437, both for Radau's stages.
    """

    stages: int = option("number s of stages; the order is 2s - 2", 5, ge=3, le=8)
    control: StageControl = option("step control", StageControl())

    world_fields: ClassVar = (
        *ATTEMPTS,
        WorldField("last_dt", "real", "s"),
        WorldField("measured_dt", "real", "s"),
        WorldField("stage_change", "real"),
        WorldField("last_change", "real"),
        WorldField("contraction", "real"),
        *(WorldField(name, "integer") for name in ("sweeping", "sweep", "stage", "out_of_range")),
    )

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
        report, forces = report_trial(context), (*context.update_lists, *context.sum_trial_forces)
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
