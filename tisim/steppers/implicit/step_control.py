"""How long the next step of an implicit stepper may be: from how its iteration went, and from its error."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.errors import must
from tisim.numerics import elementary
from tisim.steppers.implicit.excursion import Per, error_scale
from tisim.steppers.step_control import SHORTEST_STEP, StepControl, shortest_representable

LEAST_SAFETY = 0.01
"""Steps may aim at no smaller part of an error asked for than this. Where that is below what rounding makes
of an error, no step is short enough, and all would be the shortest."""


class ImplicitControl(StepControl):
    """This is the contract of step control of implicit steppers: it sets the limits of a step."""

    contract: ClassVar[bool] = True
    first: float = parameter("s", "step that is tried first, dt_0", 1e-5, ge=SHORTEST_STEP)
    longest: float = parameter("s", "longest step, dt_lim", 2.5e-4, ge=SHORTEST_STEP)
    shortest: float = parameter(
        "s",
        "shortest step; one that fails there stops its world, with time, particle and force",
        1e-12,
        ge=SHORTEST_STEP,
    )
    most: float = parameter("", "largest factor by which the step grows in one go", 4.0, ge=1)
    least: float = parameter("", "smallest factor by which the step shrinks in one go", 0.1, gt=0, lt=1)
    stride: float = parameter(
        "m",
        "longest way of a particle in a step, at the speed of its beginning; 0 for no limit",
        0.0,
        ge=0,
    )

    @property
    def at_end(self) -> bool:
        """Return whether the control aims at the error at the end of the run."""
        return False

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        name = self.kind()
        must(self.longest >= self.shortest, f"{name}.longest", "at least shortest", self.longest)
        must(self.shortest <= self.first, f"{name}.first", "at least shortest", self.first)
        return self

    def fewest(self, duration: float) -> float:
        first = min(self.first, self.longest)
        growing = duration / first
        if self.most > 1:
            # first (1 + most + ... + most^(n - 1)) = duration.
            growing = np.logaddexp(0, np.log(duration) - np.log(first) + np.log(self.most - 1)) / np.log(
                self.most
            )
        return max(duration / self.longest, float(growing))

    @ti.func
    def step(self, s, w, target, speed):
        """Return the step (s, f64) to take where ``target`` was wanted, which is 0 for the first step of all;
        ``speed`` (m/s, f64) is that of the fastest particle that takes it."""
        longest = ti.cast(self.longest(w), ti.f64)
        step = ti.min(ti.select(target > 0.0, target, ti.cast(self.first(w), ti.f64)), longest)
        stride = ti.cast(self.stride(w), ti.f64)
        if stride > 0.0:
            # No speed at all sets no limit.
            step = ti.min(step, stride / (speed + 1e-300))
        return ti.max(shortest_representable(s, w, self.shortest(w)), step)

    @ti.func
    def hopeless(self, s, w, dt):
        """Return whether a step of this length (s) that has failed must not be made shorter."""
        return dt <= shortest_representable(s, w, self.shortest(w)) * (1.0 + 1e-9)

    @ti.func
    def limited(self, w, target, actual):
        """Return wanted / reached, between ``least`` and ``most``; the least for a NaN."""
        least, most = ti.cast(self.least(w), ti.f64), ti.cast(self.most(w), ti.f64)
        factor = least
        if target >= least * actual:
            factor = ti.min(most, target / ti.max(actual, target / most))
        return factor


class IterationControl(ImplicitControl):
    """A step is so long that the fixed-point iteration meets its tolerance in the desired number of
    iterations.

        Lambda_K = (TOL / w_0)^(1/(p K_d)) / (w_K / w_0)^(1/(p K))

    w_K is the change of the last iteration over the displacement in the step, and w_0 = 1, as the first
    iterate is compared with the place where the step began (Z13 A9, Z16 C.5). The step is accepted when w_K
    <= TOL within K_d iterations; the next one is Lambda_K times as long, or a rejected one is tried again so.

    This bounds the error of the iteration only. That of the trapezoidal rule itself is not seen, and is left
    to ``longest``. What the papers leave open: the step never changes by more than ``most`` or less than
    ``least`` times in one go, and a step that fails at ``shortest`` stops the world, with time, particle and
    force.

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
        """Return whether the iteration may end, its last relative change having been this."""
        return change <= self.tolerance(w)

    @ti.func
    def accepts(self, w, error):
        """Return whether a solved step is accurate enough; ``error`` is that of the rule over the
        displacement."""
        return True

    @ti.func
    def scale(self, s, w, i, moved, dt):
        """Return what the error of a particle that has moved so far in a step of dt (s) is compared with
        (m)."""
        return moved

    @ti.func
    def aim(self, w):
        """Return TOL^(1/K_d), the same for all particles."""
        return elementary.pow(ti.cast(self.tolerance(w), ti.f64), 1.0 / self.iterations)

    @ti.func
    def factor(self, w, aim, change, k, error):
        """Return what the next step is to be multiplied by, after K = k iterations."""
        root = 1.0 / ti.cast(self.order(w), ti.f64)
        return self.limited(w, elementary.pow(aim, root), elementary.pow(change, root / k))

    @ti.func
    def stays(self, w, dt, aim, change, k, error):
        """Return whether a step (s) is the longest that may be and ``factor`` is at least 1, so that the next
        one is as long; there is no root to take."""
        bound = ti.cast(1.0, ti.f64)
        for _ in range(k):
            bound *= aim
        return dt >= ti.cast(self.longest(w), ti.f64) and change <= bound


class ErrorControl(IterationControl):
    """A step meets the tolerance of its iteration, and its truncation error is that asked for.

    The iteration is held to its tolerance as by ``iteration_control``.

    A step with more error is rejected. The error falls as dt^2. It is of position, as the stepper estimates
    it, per "step": the error of a step over the displacement in it, which says little about the end of a run;
    or per "run": the error at the end over the size of the motion. The resolution is there as for a particle
    that starts from rest, and for no force, the ratio of error and displacement has no limit.

    With ``per="run"`` the error at the end was 0.2 to 15 times that asked for in 13 scenes, less under drag
    (docs/steppers.md); a chaotic motion multiplies it without bound. ``tolerance`` stays one of a step: ask
    for a hundredth of ``error``.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, Eq. (II.4.13).
    """

    error: float = parameter("", "error of position that is asked for, relative", 1e-4, gt=0)
    safety: float = parameter(
        "", "part of that error at which the next step aims", 0.8, ge=LEAST_SAFETY, lt=1
    )
    resolution: float = parameter(
        "", "part of its radius that is added to a particle's displacement or size of motion", 1e-3, ge=0
    )
    per: Per = option(
        "what the error is relative to: the displacement in a step, or the motion of the run", "step"
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
