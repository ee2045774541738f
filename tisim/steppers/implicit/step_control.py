"""Step control of implicit steppers, by iterations or by the error of a step.

A control of the error at the end of a run gives each step a share of the error, in proportion to its length:
the error per unit step (L. F. Shampine, Math. Comp. 31 (1977) 500-512; E. Hairer, S. P. Norsett, G. Wanner,
Solving Ordinary Differential Equations I, section II.4). The errors are relative to the size of the motion so
far, the distances of particles from their starts, and not to the displacement in the step, so that they may
be added up over the run.
"""

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.errors import must
from tisim.numerics import elementary
from tisim.numerics.ieee import finite
from tisim.program.phases import PerParticle
from tisim.state.fields import Field
from tisim.steppers.step_control import SHORTEST_STEP, StepControl, shortest_representable

LEAST_SAFETY = 0.01
"""Smallest part of a requested error at which steps may aim. If a smaller part lies below the rounding level
of the error, no step is short enough, and all would be the shortest."""


Per = Literal["step", "run"]
"""Reference of a requested error: a step, relative to the displacement in it, or the end of a run, relative
to the size of the motion."""
TOTAL_DISPLACEMENT = Field("total_displacement", "m", 3, "keep", scratch=True)
"""Displacement of a particle since its start, counted through faces of a periodic box."""
EXCURSION = Field("excursion", "m", 1, "keep", scratch=True)
"""Largest distance of a particle from its start, at the ends of steps."""


def excursion_fields(at_end: bool) -> tuple[Field, ...]:
    """Return the fields for a control of the error at the end of the run."""
    return (TOTAL_DISPLACEMENT, EXCURSION) if at_end else ()


@ti.func
def error_scale(control: ti.template(), s, w, i, moved, dt):  # type: ignore[valid-type]
    """Return the scale (m) of the error of a particle that has moved by ``moved`` (m) in a step of dt (s)."""
    size, share = moved, ti.cast(1.0, s.real)
    if ti.static(control.at_end):
        size, share = ti.max(s.excursion[w, i], moved), dt / ti.cast(s.end[w], s.real)
    return share * (size + control.resolution(w) * s.radius[w, i])


@ti.func
def note_excursion(s, w, i, moved):
    """Record the displacement (m, a vector) in an accepted step."""
    s.total_displacement[w, i] = s.total_displacement[w, i] + moved
    s.excursion[w, i] = ti.max(s.excursion[w, i], s.total_displacement[w, i].norm())


class NoteExcursion(PerParticle):
    """This phase records the displacements in a step, which it gets from ``solve``."""

    def __init__(self, solve) -> None:
        super().__init__(solve.s)
        self.solve = solve

    @ti.func
    def run(self, w, i):
        note_excursion(self.s, w, i, self.solve.step_displacement(w, i, ti.cast(self.s.dt[w], self.s.real)))


class ImplicitControl(StepControl):
    """The contract of step controls of implicit steppers, with the limits of a step."""

    contract: ClassVar[bool] = True
    first: float = parameter("s", "first trial step, dt_0", 1e-5, ge=SHORTEST_STEP)
    longest: float = parameter("s", "longest step, dt_lim", 2.5e-4, ge=SHORTEST_STEP)
    shortest: float = parameter(
        "s",
        "shortest step; if it fails, its world stops, with time, particle and force",
        1e-12,
        ge=SHORTEST_STEP,
    )
    most: float = parameter("", "largest factor between a step and the next", 4.0, ge=1)
    least: float = parameter("", "smallest factor between a step and the next", 0.1, gt=0, lt=1)
    stride: float = parameter(
        "m",
        "longest path of a particle in a step, at its speed at the beginning; 0 for no limit",
        0.0,
        ge=0,
    )

    @property
    def at_end(self) -> bool:
        """Return whether the control limits the error at the end of the run."""
        return False

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        name = self.kind()
        must(self.longest >= self.shortest, f"{name}.longest", "at least shortest", self.longest)
        must(self.shortest <= self.first, f"{name}.first", "at least shortest", self.first)
        return self

    def min_steps(self, duration: float) -> float:
        first = min(self.first, self.longest)
        growing = duration / first
        if self.most > 1:
            # first (1 + most + ... + most^(n - 1)) = duration.
            growing = np.logaddexp(0, np.log(duration) - np.log(first) + np.log(self.most - 1)) / np.log(
                self.most
            )
        return max(duration / self.longest, float(growing))

    def check_start(self, start: Mapping[str, np.ndarray], hard: bool, independent: bool) -> None:
        if self.stride == 0:
            return
        with np.errstate(over="ignore", invalid="ignore"):
            # Speeds whose squares overflow are infinite here, and refused.
            velocity = start["velocity"]
            if not independent:
                velocity = velocity - np.average(velocity, axis=0, weights=start["mass"])
            path = self.shortest * float(np.linalg.norm(velocity, axis=1).max())
        rule = f"0, or at least the path of the fastest particle in the shortest step, {path:.3g} m"
        must(self.stride >= path, "stepper.control.stride", rule, self.stride)

    @ti.func
    def step(self, s, w, target, speed):
        """Return the step (s, f64) to take for a wanted step ``target``, which is 0 before the first step;
        ``speed`` (m/s, f64) : speed of the fastest particle in the step."""
        longest = ti.cast(self.longest(w), ti.f64)
        step = ti.min(ti.select(target > 0.0, target, ti.cast(self.first(w), ti.f64)), longest)
        stride = ti.cast(self.stride(w), ti.f64)
        if stride > 0.0:
            # Zero speed sets no limit.
            step = ti.min(step, stride / (speed + 1e-300))
        return ti.max(shortest_representable(s, w, self.shortest(w)), step)

    @ti.func
    def hopeless(self, s, w, dt):
        """Return whether a failed step of this length (s) must not be shortened further."""
        return dt <= shortest_representable(s, w, self.shortest(w)) * (1.0 + 1e-9)

    @ti.func
    def limited(self, w, target, actual):
        """Return target / actual, limited to ``least`` .. ``most``; ``least`` for NaN."""
        least, most = ti.cast(self.least(w), ti.f64), ti.cast(self.most(w), ti.f64)
        factor = least
        if target >= least * actual:
            factor = ti.min(most, target / ti.max(actual, target / most))
        return factor


class IterationControl(ImplicitControl):
    """The step length is chosen such that the fixed-point iteration meets its tolerance in the desired number
    of iterations.

        Lambda_K = (TOL / w_0)^(1/(p K_d)) / (w_K / w_0)^(1/(p K))

    w_K is the change of the last iteration over the displacement in the step, and w_0 = 1, because the first
    iterate is compared with the position at the beginning of the step (Z13 A9, Z16 C.5). The step is accepted
    if w_K <= TOL within K_d iterations. The length of the next step, or of the next trial of a rejected step,
    is Lambda_K times the present one.

    This bounds the error of the iteration only. The error of the trapezoidal rule itself is not measured;
    limit it by ``longest``. The papers leave two points open. Here the factor from one step to the next is
    limited to ``least`` .. ``most``, and a failed step of length ``shortest`` stops the world, with time,
    particle and force.

    Source: Z16 section 8.1.
    """

    tolerance: float = parameter(
        "", "tolerance TOL of the iteration, relative to the displacement in the step", 5e-4, gt=0
    )
    iterations: int = option("desired number K_d of iterations; a step with more is rejected", 10, ge=2)
    order: float = parameter("", "order p of convergence of the iteration in dt", 2.0, gt=0)

    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = (
        AccuracyParameter(longest=2, tolerance=1),
        AccuracyParameter(longest=2, converges=False),
        AccuracyParameter(tolerance=1, converges=False),
    )

    def asked(self) -> dict[str, float]:
        return {"tolerance": self.tolerance}

    @ti.func
    def solved(self, w, change):
        """Return whether the iteration may end after this last relative change."""
        return change <= self.tolerance(w)

    @ti.func
    def ends(self, w, change, k):
        """Return whether the iteration ends after iterate K = k, solved or given up."""
        return self.solved(w, change) or k >= self.iterations or not finite(change)

    @ti.func
    def accepts(self, w, error):
        """Return whether a solved step is accurate enough; ``error`` : error of the rule over the
        displacement."""
        return True

    @ti.func
    def scale(self, s, w, i, moved, dt):
        """Return the scale (m) of the error of a particle that has moved by ``moved`` (m) in a step of dt
        (s)."""
        return moved

    @ti.func
    def aim(self, w):
        """Return TOL^(1/K_d), the same for all particles."""
        return elementary.pow(ti.cast(self.tolerance(w), ti.f64), 1.0 / self.iterations)

    @ti.func
    def factor(self, w, aim, change, k, error):
        """Return the factor for the next step size, after K = k iterations."""
        root = 1.0 / ti.cast(self.order(w), ti.f64)
        return self.limited(w, elementary.pow(aim, root), elementary.pow(change, root / k))

    @ti.func
    def stays(self, w, dt, aim, change, k, error):
        """Return whether a step (s) is the longest and ``factor`` would be at least 1, so that the next one
        is equally long; computed without a root."""
        bound = ti.cast(1.0, ti.f64)
        for _ in range(k):
            bound *= aim
        return dt >= ti.cast(self.longest(w), ti.f64) and change <= bound


class ErrorControl(IterationControl):
    """Each step meets the tolerance of its iteration, and its truncation error meets a requested error.

    The iteration meets its tolerance as with ``iteration_control``. A step with a larger truncation error is
    rejected; the error decreases as dt^2. It is the error of position as estimated by the stepper. With per
    "step" it is the error of a step over the displacement in the step, which gives little information about
    the error at the end of a run. With per "run" it is the error at the end over the size of the motion. For
    a particle that starts from rest, or without a force, the ratio of error and displacement would have no
    limit; the resolution prevents that.

    With ``per="run"`` the error at the end was 0.2 to 15 times the requested error in 13 scenes, and smaller
    under drag (docs/steppers.md); chaotic motion amplifies it without bound. ``tolerance`` still refers to a
    step: set it to a hundredth of ``error``.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, Eq. (II.4.13).
    """

    error: float = parameter("", "requested error of position, relative", 1e-4, gt=0)
    safety: float = parameter("", "safety factor of the length of the next step", 0.8, ge=LEAST_SAFETY, lt=1)
    resolution: float = parameter(
        "", "part of its radius that is added to a particle's displacement or size of motion", 1e-3, ge=0
    )
    per: Per = option(
        "reference of the error: the displacement in a step, or the size of the motion in the run", "step"
    )

    accuracy_parameters = (AccuracyParameter(error=1, tolerance=1),)

    def asked(self) -> dict[str, float]:
        return {"error": self.error, **super().asked()}

    @property
    def at_end(self) -> bool:
        return self.per == "run"

    @ti.func
    def scale(self, s, w, i, moved, dt):
        return error_scale(self, s, w, i, moved, dt)

    @ti.func
    def accepts(self, w, error):
        return error <= self.error(w)

    @ti.func
    def factor(self, w, aim, change, k, error):
        by_iteration = IterationControl.factor(self, w, aim, change, k, error)
        target = ti.cast(self.safety(w), ti.f64) * ti.sqrt(ti.cast(self.error(w), ti.f64))
        return ti.min(by_iteration, self.limited(w, target, ti.sqrt(error)))

    @ti.func
    def stays(self, w, dt, aim, change, k, error):
        bound = ti.cast(self.safety(w), ti.f64) ** 2 * ti.cast(self.error(w), ti.f64)
        return error <= bound and IterationControl.stays(self, w, dt, aim, change, k, error)
