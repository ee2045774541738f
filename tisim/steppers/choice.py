"""The stepper of a scene that names none, chosen from its effects for a requested accuracy.

The rule, in this order:

1. Particles that only drift, and hard particles that collide, step from one meeting of surfaces to the next
   (``approach_time``).
2. Effects with a history, effects that turn with their particles or move them, and solid contacts are stepped
   by a leapfrog (``verlet``, or ``boris`` with a Lorentz force) with a fixed step: a part of the critical
   time step, 2/omega of the stiffest motion that an effect of the scene reports (``Effect.critical_step``).
3. All other forces are stepped by collocation, with the requested error.

Other scenes are refused, with the name of the effect that prevents the choice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.components.accuracy_parameter import three_digits
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, Force, PairEvent, PairForce, kinks
from tisim.errors import Words, must
from tisim.operators.base import Operator, largest_inserted
from tisim.sources.base import Source
from tisim.steppers.base import Stepper
from tisim.steppers.boris import Boris
from tisim.steppers.implicit.collocation import Collocation, StageControl
from tisim.steppers.step_control import SHORTEST_STEP, ApproachTime, FixedStep
from tisim.steppers.verlet import Verlet

ACCURACY = 1e-2
"""Accuracy of the results unless another is requested: one percent."""
ALONE, TOGETHER, KINKED, MEETING = 20.0, 75.0, 3.0, 15.0
"""The error requested from collocation is the accuracy over one of these numbers. For smooth forces: ALONE if
particles do not interact; TOGETHER if they do, because interaction amplifies errors during the run, in
eccentric orbits by 40. For forces with kinks: KINKED without pair forces, MEETING with them
(tests/hard/test_default_stepper.py, tests/steppers/test_kinked_forces.py)."""
FINE = 1e-3
"""At this accuracy and finer ones, five stages of collocation are cheapest."""
LONGEST_MEETING = 1e3
"""Longest step between collisions, over the shortest, as in Z04."""
RESOLUTION = 1e-6
"""Motions below this part of a radius need not be accurate; otherwise rounding would count as an error of
them."""


@dataclass(frozen=True)
class StepperChoice:
    """The chosen stepper and the reason for the choice. critical : critical time steps (s) by the label of
    the effect, the shortest first; only effects that have one."""

    stepper: Stepper
    reason: str
    critical: Mapping[str, float]


def choose(
    effects: Sequence[Effect],
    domain: Domain,
    start: Mapping[str, np.ndarray],
    duration: float,
    accuracy: float = ACCURACY,
) -> StepperChoice:
    """Return a stepper for effects (bound to their materials) in a domain, for a relative accuracy.

    start : initial quantities of the particles by field name, SI, without their places. duration : s. Raises
    InputError if no stepper can be chosen.
    """
    for effect in effects:
        rule = f"given, because the step length is part of the law of effects.{effect.label}"
        must(not effect.step_dependent, "scene.stepper", rule, Words("none"))
        rule = f"given, because effects.{effect.label} inserts particles later, of sizes not known in advance"
        must(not len(largest_inserted([effect])["radius"]), "scene.stepper", rule, Words("none"))
    forces = [effect for effect in effects if isinstance(effect, Force | PairForce)]
    speed = meeting_speed(effects, domain, start, duration)
    steps = told_steps(effects, start, speed)
    critical = finite_steps(steps)
    needed = [effect for effect in effects if effect.leapfrog]
    if not (forces or needed) or any(isinstance(effect, PairEvent) for effect in effects):
        return _meetings(effects, start, speed, critical, steps, accuracy)
    contacts = [one for one in forces if one.kinked and isinstance(one, PairForce) and one.solid]
    told = None not in steps.values() and bool(critical)
    if needed or domain.shears() or (contacts and told):
        why = (needed or contacts or [domain])[0].label
        return _leapfrog(effects, why, critical, steps, duration, accuracy)
    return _error_controlled(effects, domain, start, speed, critical, duration, accuracy)


def critical_steps(
    effects: Sequence[Effect], domain: Domain, start: Mapping[str, np.ndarray], duration: float
) -> dict[str, float]:
    """Return the critical time steps (s) of the effects that have one, by label, the shortest first."""
    speed = meeting_speed(effects, domain, start, duration)
    return finite_steps(told_steps(effects, start, speed))


def told_steps(
    effects: Sequence[Effect], start: Mapping[str, np.ndarray], speed: float
) -> dict[str, float | None]:
    """Return the critical time step (s) of each effect by label; None if it is unknown, or if its arithmetic
    overflows or gives less than the shortest step.

    speed : m/s, at which particles meet.
    """
    steps: dict[str, float | None] = {}
    with np.errstate(all="ignore"):
        for effect in effects:
            try:
                step = effect.critical_step(start, speed, effects)
            except ArithmeticError:
                step = None
            steps[effect.label] = step if step is not None and step >= SHORTEST_STEP else None
    return steps


def finite_steps(steps: Mapping[str, float | None]) -> dict[str, float]:
    """Return the known, finite steps (s) among these, the shortest first."""
    known = {label: step for label, step in steps.items() if step is not None and math.isfinite(step)}
    return dict(sorted(known.items(), key=lambda item: item[1]))


@np.errstate(over="ignore", invalid="ignore")
def meeting_speed(
    effects: Sequence[Effect], domain: Domain, start: Mapping[str, np.ndarray], duration: float
) -> float:
    """Return the speed (m/s) at which particles are expected to meet each other, or a wall."""
    velocity, (low, high) = start["velocity"], domain.bounds()
    extent = math.inf if low is None or high is None else float(np.linalg.norm(high - low))
    if not len(velocity):
        return sum(effect.reached_speed(duration, extent) for effect in effects)
    # Relative to each other, and relative to whatever is at rest or held.
    own = float(np.linalg.norm(velocity - velocity.mean(axis=0), axis=1).max())
    speed = max(2 * own, float(np.linalg.norm(velocity, axis=1).max()))
    return speed + sum(effect.reached_speed(duration, extent) for effect in effects)


def leapfrog_step(
    effects: Sequence[Effect], critical: Mapping[str, float], accuracy: float
) -> tuple[float, str]:
    """Return the longest step (s) of a leapfrog at which every effect is accurate enough, and the label of
    the effect that limits it; infinity if no effect has a critical step."""
    steps = {
        effect.label: effect.part_of_critical_step(accuracy) * critical[effect.label]
        for effect in effects
        if effect.label in critical
    }
    label = min(steps, key=lambda name: steps[name], default="")
    return steps.get(label, math.inf), label


def _meetings(
    effects: Sequence[Effect],
    start: Mapping[str, np.ndarray],
    speed: float,
    critical: Mapping[str, float],
    steps: Mapping[str, float | None],
    accuracy: float,
) -> StepperChoice:
    _check_told(steps, "collisions")
    for effect in effects:
        rule = f"given, because no default stepper suits both collisions and effects.{effect.label}"
        suits = ApproachTime.kind() not in effect.incompatible_controls and not effect.gyrates(effects)
        must(suits, "scene.stepper", rule, Words("none"))
    control, events = ApproachTime(), any(isinstance(effect, PairEvent) for effect in effects)
    smallest = float(start["radius"].min(initial=math.inf))
    shortest, longest = control.shortest, control.longest
    if events and speed > 0 and math.isfinite(smallest):
        # Particles that meet within the shortest step are moved into each other by this part of a radius.
        shortest = accuracy * smallest / speed
        longest = LONGEST_MEETING * shortest
    if any(isinstance(effect, Operator) for effect in effects):
        # Operators that act between collisions, such as cooling or reactions, act once per step.
        longest = min(longest, ApproachTime().longest)
    longest = min(longest, leapfrog_step(effects, critical, accuracy)[0])
    control = ApproachTime(shortest=_length(min(shortest, longest)), longest=_length(longest))
    what = "particles collide" if events else "no force acts"
    reason = f"{what}: steps that end when two surfaces meet, of {control.shortest:.3g} s at least"
    return StepperChoice(Verlet(control=control), reason, critical)


def _leapfrog(
    effects: Sequence[Effect],
    why: str,
    critical: Mapping[str, float],
    steps: Mapping[str, float | None],
    duration: float,
    accuracy: float,
) -> StepperChoice:
    _check_told(steps, f"effects.{why}")
    touching = any(isinstance(effect, PairForce) and effect.short_ranged for effect in effects)
    rule = f"given, because no critical time step is known for {why}"
    must(bool(critical) or not touching, "scene.stepper", rule, Words("none"))
    longest, label = leapfrog_step(effects, critical, accuracy)
    # The duration is divided if no motion has a critical step, and also if an effect acts once per step or
    # may set in during the run.
    divided = not critical or any(isinstance(effect, Operator | Source) for effect in effects)
    dt = _length(min(longest, (accuracy if divided else 0.1) * duration))
    gyrates = any(effect.gyrates(effects) for effect in effects)
    others = [one.label for one in effects if one.leapfrog and not isinstance(one, Force | PairForce)]
    if gyrates and others:
        rule = f"given, because no default stepper suits both a magnetic force and effects.{others[0]}"
        must(False, "scene.stepper", rule, Words("none"))
    stepper = (Boris if gyrates else Verlet)(control=FixedStep(dt=dt))
    reason = (
        f"a leapfrog, for {why}: steps of {accuracy:g} of the duration, as no critical time step is known"
    )
    if critical:
        part = f"{dt / critical[label]:.3g} of the critical time step, {critical[label]:.3g} s, of {label}"
        reason = f"a leapfrog, for {why}: steps of {part}"
    return StepperChoice(stepper, reason, critical)


def _error_controlled(
    effects: Sequence[Effect],
    domain: Domain,
    start: Mapping[str, np.ndarray],
    speed: float,
    critical: Mapping[str, float],
    duration: float,
    accuracy: float,
) -> StepperChoice:
    pairwise, kinked = any(isinstance(effect, PairForce) for effect in effects), kinks(effects, domain)
    # Operators act, and observers sample, once per step.
    sampled = any(isinstance(effect, Operator) for effect in effects)
    stride = _stride(effects, start)
    # The shortest step is so short that the fastest particle moves by less than a stride in it.
    within = 0.5 * stride / speed if stride > 0 and speed > 0 else math.inf
    limits = {
        "first": _length(min(1e-6, 1e-4 * duration)),
        "longest": _length(0.1 * duration * (accuracy if sampled else 1.0)),
        "shortest": max(SHORTEST_STEP, min(1e-12, 1e-10 * duration, within)),
        "stride": stride,
        "resolution": RESOLUTION,
    }
    smooth = TOGETHER if pairwise else ALONE
    error = accuracy / ((MEETING if pairwise else KINKED) if kinked else smooth)
    control = StageControl(error=error, per="run", norm="each", **limits)
    stages = 3 if kinked else _stages(effects, accuracy)
    stepper = Collocation(control=control, stages=stages)
    what = f"forces have kinks, of {kinked[0]}" if kinked else "forces are smooth"
    reason = f"{what}: collocation with {stages} stages and an error of {error:.3g} at the end"
    return StepperChoice(stepper, reason, critical)


def _stages(effects: Sequence[Effect], accuracy: float) -> int:
    """Return the number of stages that reach an accuracy with the fewest force evaluations, for smooth
    forces.

    If velocities gyrate, a step takes more sweeps, because each gains one order of dt instead of two; fewer
    steps of a higher order are then cheaper.
    """
    if accuracy <= FINE:
        return 5
    return 4 if any(effect.gyrates(effects) for effect in effects) else 3


def _stride(effects: Sequence[Effect], start: Mapping[str, np.ndarray]) -> float:
    """Return the longest path (m) of a particle in a step that cannot skip a force or a field; 0 for no
    limit."""
    lengths = [effect.shortest_length() for effect in effects if isinstance(effect, Source)]
    if any(isinstance(effect, PairForce) and effect.short_ranged for effect in effects):
        lengths.append(float(start["radius"].min(initial=math.inf)))
    shortest = min(lengths, default=math.inf)
    return 0.5 * shortest if math.isfinite(shortest) else 0.0


def _check_told(steps: Mapping[str, float | None], what: str) -> None:
    """Raise InputError if an effect does not report its critical step; ``what`` : effect or event that needs
    it."""
    for label, step in steps.items():
        rule = f"given, because no critical time step is known for effects.{label}, which {what} would need"
        must(step is not None, "scene.stepper", rule, Words("none"))


def _length(step: float) -> float:
    """Return a step (s) rounded to three digits and not below the shortest."""
    return max(SHORTEST_STEP, three_digits(step))
