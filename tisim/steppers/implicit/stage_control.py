"""Step control of the collocation stepper: by an estimate of its error, and by how its sweeps converge."""

from __future__ import annotations

from typing import Literal

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import option, parameter
from tisim.numerics import elementary
from tisim.steppers.implicit.excursion import Per, error_scale
from tisim.steppers.implicit.step_control import LEAST_SAFETY, ImplicitControl
from tisim.steppers.step_control import SHORTEST_STEP

CONTRACTION = 0.25
"""A sweep is to multiply the error by this, at most, where convergence limits the step."""


@ti.func
def eighth_powers(x):
    square = x * x
    return square * square * square * square


class StageControl(ImplicitControl):
    """A step of collocation has the error that is asked for, and sweeps that converge.

    The error is of position, of the sum over the particles or of each (``norm``), per "step": a bound of the
    error of a step over the displacement in it, mostly far above the error itself; or per "run": the error at
    the end over the size of the motion, by the leading term of the method's own error where forces are
    smooth. A weak kink hides in that term, so where forces have kinks (``Effect.kinked``) the bound is taken
    then, too. The resolution is there as for a particle that starts from rest the ratio of error and
    displacement has no limit.

    With ``per="run"`` the error at the end was 0.03 to 30 times that asked for in 13 scenes, less under drag.
    With kinks it was up to 9 times that for particles by themselves, and up to 70 for pairs at a cut-off
    (docs/steppers.md). A chaotic motion multiplies it without bound.

    With ``norm="each"`` a particle's error is compared with its own motion, so that slow ones, and small
    orbits, are as accurate as large ones: the world has the norm of order 8 of these ratios, which is at
    most N^(1/8) times the largest.

    Sweeps end once the change in the last one, times the factor by which a sweep makes the error smaller, is
    below ``part`` of the error. The factor is that of the last two sweeps; in the first, that of the last
    steps for the present length.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Eqs (IV.8.10), (IV.8.11).
    """

    error: float = parameter("", "error of position that is asked for, relative", 1e-6, gt=0)
    part: float = parameter("", "part of that error that may be left when sweeps end", 0.3, gt=0)
    sweeps: int = option("sweeps that a step may take at most", 10, ge=2)
    safety: float = parameter(
        "",
        "part of that error at which the next step aims",
        0.85,
        ge=LEAST_SAFETY,
        lt=1,
    )
    resolution: float = parameter(
        "", "part of its radius that is added to a particle's displacement or size of motion", 1e-3, ge=0
    )
    per: Per = option(
        "what the error is relative to: the displacement in a step, or the motion of the run", "step"
    )
    norm: Literal["sum", "each"] = option(
        "whether the sum over the particles has that error, or each particle by itself", "sum"
    )
    first: float = parameter("s", "step that is tried first", 1e-6, ge=SHORTEST_STEP)
    longest: float = parameter("s", "longest step", 1.0, ge=SHORTEST_STEP)

    accuracy_parameters = (AccuracyParameter(error=1),)

    def asked(self) -> dict[str, float]:
        return {"error": self.error}

    @property
    def at_end(self) -> bool:
        return self.per == "run"

    def leading(self, smooth: bool) -> bool:
        """Return whether the estimate of error is of the leading term, not the bound: only for smooth
        forces."""
        return self.at_end and smooth

    def order(self, stages: int, smooth: bool) -> int:
        """Return the power of dt with which an estimate of error falls, over what it is compared with."""
        return 2 * stages - 2 if self.leading(smooth) else stages

    @ti.func
    def scale(self, s, w, i, moved, dt):
        """Return what the error of a particle that has moved so far in a step of dt (s) is compared with
        (m)."""
        return error_scale(self, s, w, i, moved, dt)

    @ti.func
    def terms(self, change, error, scale, rounding):
        """Return the terms (f64) of a particle in the sums over the world: what its motion changed by in this
        sweep, its error, what both are compared with, and what they are rounded to (m)."""
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
        """Return whether sweeps may end, with this much error left."""
        return error <= ti.cast(self.part(w) * self.error(w), ti.f64)

    @ti.func
    def accepts(self, w, error):
        """Return whether a solved step is accurate enough."""
        return error <= ti.cast(self.error(w), ti.f64)

    @ti.func
    def factor(self, w, contraction, error, order):
        """Return what the next step is to be multiplied by: the error falls as dt^order, the contraction as
        dt^2."""
        tolerance = ti.cast(self.error(w), ti.f64)
        target = ti.cast(self.safety(w), ti.f64) * elementary.pow(tolerance, 1.0 / order)
        by_error = self.limited(w, target, elementary.pow(error, 1.0 / order))
        return ti.min(by_error, self.limited(w, ti.sqrt(CONTRACTION), ti.sqrt(contraction)))
