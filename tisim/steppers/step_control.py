"""How long the next step may be: fixed, or from the time until surfaces meet."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import Component, parameter
from tisim.errors import must

HALF_DIGIT = 2.0**-24
"""Numbers are rounded by at most this part of them in single precision."""
TOUCH = 1.0 + 1e-6
"""Steps go this much past the meeting of surfaces, so that rounding does not decide whether they have met."""
SHORTEST_STEP = 1e-30
"""This is the shortest step that may be asked for, s: light goes 3e-22 m in it, and single precision holds
it."""
MOST_STEPS = 2.0**53
"""A run may take so many steps: with more, one is shorter than what the time at the end is rounded to."""


@ti.func
def note_speed(s, w, i):
    """Note the speed (m/s, f64) of a particle relative to the world's frame, of which the largest counts."""
    speed = (ti.cast(s.velocity[w, i], ti.f64) - s.axes(s.frame, w)).norm()
    if speed > s.fastest[w]:
        ti.atomic_max(s.fastest[w], speed)


@ti.func
def shortest_representable(s, w, shortest):
    """Return the shortest step (s, f64), where ``shortest`` is asked for, that the time at the end still
    tells."""
    return ti.max(ti.cast(shortest, ti.f64), s.end[w] / MOST_STEPS)


class StepControl(Component):
    """Step control chooses the length of steps; ``pair`` sees every near pair, ``note`` every particle.

    watches_pairs : whether it needs to see pairs at all. world_quantities : names of the quantities that it
    keeps of a world.
    """

    contract: ClassVar[bool] = True
    watches_pairs: ClassVar[bool] = False
    world_quantities: ClassVar[tuple[str, ...]] = ()

    @ti.func
    def pair(self, s, w, i, j, separation):
        """Return the time (s, f64) that this pair allows."""
        return ti.cast(ti.math.inf, ti.f64)

    @ti.func
    def note(self, s, w, i, soonest):
        """Note for a particle the least time (s, f64) that its pairs allow."""

    def fewest(self, duration: float) -> float:
        """Return the number of steps that a run of this duration (s) takes at least."""
        return 1.0

    def asked(self) -> dict[str, float]:
        """Return the relative errors that steps are asked for, by the names of its settings; by default
        none."""
        return {}

    def suits_start(self, radius: np.ndarray, velocity: np.ndarray) -> None:
        """Raise InputError when its steps do not suit a start of hard particles that collide: their radii
        (m, shape (n,)) and velocities (m/s, shape (n, 3)); by default they do."""


class Controller(StepControl):
    """Control of explicit steppers decides how long a step is before it is made."""

    contract: ClassVar[bool] = True

    @ti.func
    def next(self, s, w, horizon):
        """Return the length (s, f64) of the next step; pairs within a gap of ``horizon`` (m) were seen."""
        return ti.cast(0.0, ti.f64)


class FixedStep(Controller):
    """All steps are of one length; the last one is cut to end on time."""

    dt: float = parameter("s", "length dt of a step", examples=[1e-6], ge=SHORTEST_STEP)

    accuracy_parameters = (AccuracyParameter(dt=2),)

    def fewest(self, duration: float) -> float:
        return duration / self.dt

    @ti.func
    def next(self, s, w, horizon):
        dt = ti.cast(self.dt(w), ti.f64)
        if ti.static(s.real == ti.f32):
            # It is known to half a last digit: where that is the difference, whole steps lead to the end.
            remaining = s.end[w] - s.time[w]
            steps = ti.round(remaining / dt)
            if steps >= 1.0 and ti.abs(remaining - steps * dt) <= HALF_DIGIT * remaining:
                dt = remaining / steps
        return dt


class ApproachTime(Controller):
    """A step is as long as the least time until two surfaces meet, gap over approach speed, within limits.

    Z04 asks each particle's nearest neighbour only; here every approaching pair is asked, as the nearest
    is not always the first to be met. The limits are those of Z04 section 8 unless given. A scene of hard
    particles that would pass through each other in the shortest step is refused.

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

    def fewest(self, duration: float) -> float:
        return duration / self.longest

    def suits_start(self, radius: np.ndarray, velocity: np.ndarray) -> None:
        # In one step of a radius each, two that meet head on are past each other: no impact is seen.
        with np.errstate(over="ignore", invalid="ignore"):
            # Speeds whose squares are more than numbers hold are infinite here, and refused.
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
            # Pairs not seen are farther apart than this, and close no faster than twice the fastest.
            dt = ti.min(dt, ti.cast(horizon, ti.f64) / (2.0 * s.fastest[w] + 1e-300))
        return ti.max(
            shortest_representable(s, w, self.shortest(w)), ti.min(dt, ti.cast(self.longest(w), ti.f64))
        )
