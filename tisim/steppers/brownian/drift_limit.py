"""The step length of Brownian dynamics, limited by the displacement due to forces."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.errors import must
from tisim.numerics.ieee import finite
from tisim.state.fields import WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.step_control import SHORTEST_STEP, Controller

LARGEST_DRIFT = 1e9
"""Largest number of steps in one longest step; an independent particle numbers them with 32 bits."""


@ti.func
def fault(rate):
    """Return the status for a force that requires steps of 1/rate, which are too short."""
    return ti.select(finite(rate), WorldStatus.FORCE_TOO_STEEP, WorldStatus.NOT_FINITE)


class DriftLimit(Controller):
    """The step is so short that forces push no particle farther than a given part of its radius.

    The limited velocity is the part due to forces, sum_j D_ij F_j / kT, at the start of the step. The step
    therefore depends on nothing random within it, and its noise has the distribution of a step of given
    length. The flow is not limited, because it moves neighbours alike; choose ``longest`` to resolve it. The
    displacement by noise is not limited either: a particle diffuses by sqrt(2 D dt) into the potential of
    another before it feels the force, and is then pushed out in steps of at most ``drift`` radii. So overlaps
    stay bounded for any step length, but for correct statistics of contacts, ``longest`` must keep sqrt(2 D
    dt) below the range over which the potential changes by kT.
    """

    longest: float = parameter(
        "s",
        "longest step; particles without interaction are at a common time at its multiples",
        examples=[1e-4],
        ge=SHORTEST_STEP,
    )
    shortest: float = parameter(
        "s", "shortest step; a force that requires a shorter one stops its world", 1e-12, ge=SHORTEST_STEP
    )
    drift: float = parameter("", "largest displacement by forces in a step, over the radius", 0.05, gt=0)

    world_fields: ClassVar = (WorldField("steepest", "real"),)
    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = (
        AccuracyParameter(longest=1, drift=1),
        AccuracyParameter(longest=1, converges=False),
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        must(self.longest >= self.shortest, "drift_limit.longest", "at least shortest", self.longest)
        allowed = f"at least longest/{LARGEST_DRIFT:.0e}"
        must(self.shortest * LARGEST_DRIFT >= self.longest, "drift_limit.shortest", allowed, self.shortest)
        return self

    def min_steps(self, duration: float) -> float:
        return duration / self.longest

    @ti.func
    def rate(self, s, w, i, velocity):
        """Return the inverse of the step (1/s, f64) that a particle allows if forces move it at ``velocity``
        (m/s)."""
        return ti.cast(velocity.norm() / (self.drift(w) * s.radius[w, i]), ti.f64)

    @ti.func
    def easy(self, s, w, i, velocity):
        """Return whether a particle allows the longest step; False for NaN. This is computed without root and
        division, which would take longer than the rest of a step."""
        reach, path = self.drift(w) * s.radius[w, i], self.longest(w) * velocity
        return path.norm_sqr() < reach * reach

    @ti.func
    def hopeless(self, w, rate):
        """Return whether the step for this rate (1/s) is too short; also True for NaN."""
        return not (rate * ti.cast(self.shortest(w), ti.f64) <= 1.0)

    @ti.func
    def step(self, w, rate):
        """Return the step (s, f64) for this rate (1/s)."""
        dt = ti.cast(self.longest(w), ti.f64)
        # This branch is rarely taken; then the other particles need not wait for the force.
        if rate * dt > 1.0:
            dt = 1.0 / rate
        return dt

    @ti.func
    def next(self, s, w, horizon):
        return self.step(w, s.steepest[w])
