"""How long a step of Brownian dynamics may be: from how far forces would push particles in it."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.errors import must
from tisim.numerics.ieee import finite
from tisim.state.status import WorldStatus
from tisim.steppers.step_control import SHORTEST_STEP, Controller

LARGEST_DRIFT = 1e9
"""The number of steps in one longest step is at most this: a particle by itself numbers them with 32 bits."""


@ti.func
def fault(rate):
    """Return the status that says what is wrong with a force that asks for steps of 1/rate which are too
    short."""
    return ti.select(finite(rate), WorldStatus.FORCE_TOO_STEEP, WorldStatus.NOT_FINITE)


class DriftLimit(Controller):
    """A step is so short that no force pushes a particle farther than a part of its radius.

    The velocity that is limited is that which forces give, sum_j D_ij F_j / kT, at the start of the step; so
    the step depends on nothing that is random in it, and its noise has the law of a step given beforehand.
    The flow is left out: it pushes neighbours alike, and to resolve it is up to ``longest``. What noise does
    in a step is not limited either: a particle diffuses by sqrt(2 D dt) into the potential of another before
    it feels that, and is pushed out again in steps of at most ``drift`` radii. So overlaps stay bounded
    whatever the step, but for right statistics of contacts, ``longest`` has to keep sqrt(2 D dt) below the
    range over which the potential changes by kT.
    """

    longest: float = parameter(
        "s",
        "longest step; particles by themselves meet at multiples of it",
        examples=[1e-4],
        ge=SHORTEST_STEP,
    )
    shortest: float = parameter(
        "s", "shortest step; a force that asks for less stops its world", 1e-12, ge=SHORTEST_STEP
    )
    drift: float = parameter("", "largest displacement by forces in a step, over the radius", 0.05, gt=0)

    world_quantities: ClassVar = ("steepest",)
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

    def fewest(self, duration: float) -> float:
        return duration / self.longest

    @ti.func
    def rate(self, s, w, i, velocity):
        """Return 1 over the step (1/s, f64) that a particle allows which forces move at ``velocity``
        (m/s)."""
        return ti.cast(velocity.norm() / (self.drift(w) * s.radius[w, i]), ti.f64)

    @ti.func
    def easy(self, s, w, i, velocity):
        """Return whether a particle allows the longest step, found without root and division, which take
        longer than the rest of a step; False for a NaN."""
        reach, path = self.drift(w) * s.radius[w, i], self.longest(w) * velocity
        return path.norm_sqr() < reach * reach

    @ti.func
    def hopeless(self, w, rate):
        """Return whether the step for this rate (1/s) is too short; also True for a NaN."""
        return not (rate * ti.cast(self.shortest(w), ti.f64) <= 1.0)

    @ti.func
    def step(self, w, rate):
        """Return the step (s, f64) for this rate (1/s)."""
        dt = ti.cast(self.longest(w), ti.f64)
        # A branch that is mostly not taken: others need not wait for the force.
        if rate * dt > 1.0:
            dt = 1.0 / rate
        return dt

    @ti.func
    def next(self, s, w, horizon):
        return self.step(w, s.steepest[w])
