"""The length of the next step: fixed, or from the time until surfaces meet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import Component, parameter
from tisim.errors import must
from tisim.state.fields import WorldField

HALF_DIGIT = 2.0**-24
"""Largest relative rounding error in single precision."""
TOUCH = 1.0 + 1e-6
"""Steps end later than the meeting of surfaces by this factor, so that rounding does not decide whether they
have met."""
SHORTEST_STEP = 1e-30
"""Shortest step that may be requested, s: light travels 3e-22 m in it, and single precision can represent
it."""
MOST_STEPS = 2.0**53
"""Largest number of steps of a run: with more, a step would be shorter than the rounding error of the time at
the end."""


@ti.func
def note_speed(s, w, i):
    """Record the speed (m/s, f64) of a particle relative to the world's frame, if it is the largest so
    far."""
    speed = (ti.cast(s.velocity[w, i], ti.f64) - s.axes(s.frame, w)).norm()
    if speed > s.fastest[w]:
        ti.atomic_max(s.fastest[w], speed)


@ti.func
def shortest_representable(s, w, shortest):
    """Return the shortest step (s, f64) that changes the time at the end of the run; at least
    ``shortest``."""
    return ti.max(ti.cast(shortest, ti.f64), s.end[w] / MOST_STEPS)


class StepControl(Component):
    """Step control chooses the length of steps; ``pair`` is called for every near pair, ``note`` for every
    particle.

    watches_pairs : whether it needs pairs at all. world_fields : the numbers of a world that it keeps.
    """

    contract: ClassVar[bool] = True
    watches_pairs: ClassVar[bool] = False
    world_fields: ClassVar[tuple[WorldField, ...]] = ()

    @ti.func
    def pair(self, s, w, i, j, separation):
        """Return the time (s, f64) that this pair allows."""
        return ti.cast(ti.math.inf, ti.f64)

    @ti.func
    def note(self, s, w, i, soonest):
        """Record for a particle the least time (s, f64) that its pairs allow."""

    def min_steps(self, duration: float) -> float:
        """Return the smallest number of steps of a run of this duration (s)."""
        return 1.0

    def asked(self) -> dict[str, float]:
        """Return the relative errors requested of steps, by the names of the settings; by default none."""
        return {}

    def check_start(self, start: Mapping[str, np.ndarray], hard: bool, independent: bool) -> None:
        """Raise InputError if the limits of a step do not suit an initial state, by field name; by default
        they do.

        hard : whether the particles collide as hard ones. independent : whether each takes its own steps.
        """


class Controller(StepControl):
    """Control of explicit steppers chooses the length of a step before the step is taken."""

    contract: ClassVar[bool] = True

    @ti.func
    def next(self, s, w, horizon):
        """Return the length (s, f64) of the next step; pairs with a gap below ``horizon`` (m) have been
        examined."""
        return ti.cast(0.0, ti.f64)


class FixedStep(Controller):
    """All steps have the same length; the last one is shortened to end at the end of the run."""

    dt: float = parameter("s", "length dt of a step", examples=[1e-6], ge=SHORTEST_STEP)

    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = (AccuracyParameter(dt=2),)

    def min_steps(self, duration: float) -> float:
        return duration / self.dt

    @ti.func
    def next(self, s, w, horizon):
        dt = ti.cast(self.dt(w), ti.f64)
        if ti.static(s.real == ti.f32):
            # dt is known to half a unit in the last place: if the deviation is within that, whole steps lead
            # to the end.
            remaining = s.end[w] - s.time[w]
            steps = ti.round(remaining / dt)
            if steps >= 1.0 and ti.abs(remaining - steps * dt) <= HALF_DIGIT * remaining:
                dt = remaining / steps
        return dt


class ApproachTime(Controller):
    """The step length is the least time until two surfaces meet, gap over approach speed, within limits.

    Z04 uses only the nearest neighbour of each particle. Here every approaching pair is examined, because the
    nearest neighbour is not always met first. The default limits are taken from Z04 section 8. A scene of
    hard particles that would pass through each other in the shortest step is refused.

    Source: Z04 Eq. (6.14).
    """

    shortest: float = parameter("s", "shortest step", 1e-6, ge=SHORTEST_STEP)
    longest: float = parameter("s", "longest step", 1e-3, ge=SHORTEST_STEP)
    watches_pairs: ClassVar[bool] = True

    accuracy_parameters = (
        AccuracyParameter(shortest=1, longest=1),
        AccuracyParameter(shortest=1, converges=False),
        AccuracyParameter(longest=1, converges=False),
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        must(self.longest >= self.shortest, "approach_time.longest", "at least shortest", self.longest)
        return self

    def min_steps(self, duration: float) -> float:
        return duration / self.longest

    def check_start(self, start: Mapping[str, np.ndarray], hard: bool, independent: bool) -> None:
        if not hard:
            return
        radius, velocity = start["radius"], start["velocity"]
        # Two particles that meet head on, and move by a radius each in one step, have passed each other: no
        # impact is detected.
        with np.errstate(over="ignore", invalid="ignore"):
            # Speeds whose squares overflow are infinite here, and refused.
            fastest = float(np.linalg.norm(velocity - velocity.mean(axis=0), axis=1).max(initial=0.0))
        smallest = float(radius.min(initial=np.inf))
        rule = f"so short that no particle moves by more than the smallest radius, {smallest:.3g} m, in it"
        rule += f" at {fastest:.3g} m/s"
        must(self.shortest * fastest <= smallest, "stepper.control.shortest", rule, self.shortest)

    @ti.func
    def pair(self, s, w, i, j, separation):
        # Approach speed times distance: (v_i - v_j).(r_j - r_i).
        closing = (s.velocity[w, i] - s.velocity[w, j]).dot(separation)
        reach = s.radius[w, i] + s.radius[w, j]
        time = ti.cast(ti.math.inf, ti.f64)
        if closing > 0.0 and separation.norm_sqr() > reach * reach:
            distance = separation.norm()
            time = ti.cast((distance - reach) * distance / closing, ti.f64) * TOUCH
        return time

    @ti.func
    def note(self, s, w, i, soonest):
        if soonest < s.approach_time[w]:
            ti.atomic_min(s.approach_time[w], soonest)
        note_speed(s, w, i)

    @ti.func
    def next(self, s, w, horizon):
        dt = s.approach_time[w]
        if horizon > 0.0:
            # Pairs that were not examined have a larger gap than this, and approach no faster than twice the
            # fastest speed.
            dt = ti.min(dt, ti.cast(horizon, ti.f64) / (2.0 * s.fastest[w] + 1e-300))
        return ti.max(
            shortest_representable(s, w, self.shortest(w)), ti.min(dt, ti.cast(self.longest(w), ti.f64))
        )
