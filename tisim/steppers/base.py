"""The contract of a stepper: the order of the phases in a step."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from tisim.components.component import Component, option
from tisim.effects.base import (
    Constraint,
    DerivedQuantity,
    Effect,
    Force,
    HardBodies,
    LongRange,
    PairEvent,
    SceneParts,
    SelfConsistentQuantity,
)
from tisim.errors import must
from tisim.sources.base import Source
from tisim.state.fields import Field, WorldField
from tisim.steppers.context import Step, StepContext
from tisim.steppers.step_control import MOST_STEPS, StepControl


def single(effect: Effect) -> bool:
    """Return whether an effect acts on each particle by itself and has no history."""
    if isinstance(effect, Force):
        return not (effect.offers("load") or isinstance(effect, LongRange))
    mutual = isinstance(effect, SelfConsistentQuantity | LongRange)
    return isinstance(effect, Source | DerivedQuantity) and not mutual


class Stepper(Component):
    """A stepper advances time, and its control chooses the length of each step: the contract of both.

    Before the first step, ``force`` and ``torque`` have the values of the initial state.

    world_fields : the numbers of a world that it counts or keeps, as ``WorldField``. random : whether it
    draws random numbers, so that only statistics converge. all_pairs : whether it sums over all pairs itself.
    follows_shear : whether it places moved particles with ``domain.put``, at the time of the new place, and
    reports displacements relative to ``drift``, so that it can step a sheared box. follows_constraints :
    whether it leaves particles held by constraints to the constraints. packs : whether it moves hard bodies.
    ends : the counters that are not 0 if it has ended a world before its duration, each with the reason.
    """

    contract: ClassVar[bool] = True
    all_pairs: ClassVar[bool] = False
    world_fields: ClassVar[tuple[WorldField, ...]] = ()
    ends: ClassVar[Mapping[str, str]] = {}
    random: ClassVar[bool] = False
    follows_shear: ClassVar[bool] = False
    follows_constraints: ClassVar[bool] = False
    packs: ClassVar[bool] = False
    control: StepControl = option("step control, which chooses the length of the next step")

    @property
    def order(self) -> int:
        """Return the order of the stepper's error in dt, for smooth forces."""
        return 2

    def check(self, scene: SceneParts) -> None:
        """Raise InputError if the stepper cannot step the effects of a scene in its domain."""
        effects, domain = scene.effects, scene.domain
        for effect in effects:
            if isinstance(effect, Constraint):
                rule = f"one that follows constraints, such as verlet, with effects.{effect.label}"
                must(self.follows_constraints, "stepper", rule, self.kind())
            elif isinstance(effect, HardBodies):
                rule = f"one that packs, such as mechanical_contraction, with effects.{effect.label}"
                must(self.packs, "stepper", rule, self.kind())
        if domain.shears():
            where = f"in a {domain.kind()}"
            rule = f"one that follows shear, such as verlet or boris, {where}"
            must(self.follows_shear, "stepper", rule, self.kind())
            rule = f"one that does not depend on pairs, such as fixed_step, {where}"
            must(not self.control.watches_pairs, "stepper.control", rule, self.control.kind())
            for effect in effects:
                name = f"effects.{effect.label}"
                must(not isinstance(effect, PairEvent), name, f"a force, not a pair event, {where}", name)
                rule = f"the same at all places (homogeneous), as gravity is, {where}"
                must(effect.homogeneous, name, rule, effect.kind())

    def resolves(self, effects: Sequence[Effect], start: Callable[[], Mapping[str, np.ndarray]]) -> None:
        """Raise InputError if steps are known beforehand to be too long for a motion that an effect causes;
        by default this is detected in the run. start : function that returns the initial quantities of the
        particles, SI, without their places."""

    def countable(self, effects: Sequence[Effect]) -> float:
        """Return the number of steps that the stepper can count in a scene of these effects."""
        return MOST_STEPS

    def min_steps(self, effects: Sequence[Effect], duration: float) -> float:
        """Return the smallest number of steps of a run of this duration (s); raise InputError if it exceeds
        the number that can be counted."""
        steps, most = min(self.control.min_steps(duration), sys.float_info.max), self.countable(effects)
        rule = f"reached in at most {most:.3g} steps, but takes at least {steps:.3g} of {self.control.kind()}"
        must(steps <= most, "scene.duration", rule, duration)
        return max(1.0, steps)

    def independent(self, effects: Sequence[Effect]) -> bool:
        """Return whether the stepper may advance each particle by itself: by default, if particles do not
        interact and only forces change them."""
        return all(single(effect) for effect in effects)

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        """Return the steppers of this class for ``tisim cost`` to try in a scene with these effects and steps
        of about dt (s); by default none."""
        return ()

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Any, ...] | None:
        """Return the steppers to compare with this one; None, the default, for the alternatives of every
        class."""
        return None

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        """Return the number of force evaluations per particle, averaged over particles, from the counts of a
        run; by default one per step."""
        return work["particle_steps"] / particles

    def structure(self) -> tuple[Any, ...]:
        own = tuple(option for option in super().structure() if option != ("control", self.control))
        return (*own, *self.control.structure())

    def fields(self, effects: Sequence[Effect]) -> tuple[str | Field, ...]:
        """Return the fields that the stepper reads or writes in a scene of these effects."""
        return ()

    def step(self, context: StepContext) -> Step:
        """Return the items of a step, up to pair events and the action of operators on the world as a whole.

        They must: set ``dt``; advance ``time``, to ``end`` at most; count ``steps`` and ``particle_steps``;
        set ``events`` to 0; after the control has chosen the step, set ``approach_time`` to infinity and
        ``fastest`` to 0, for the data of the next step; call ``particle`` of each operator; put particles
        that have left the domain back into it; and report how far particles have moved: ``displacement``
        relative to the frame, then ``neighbour_lists.moved(w)``, or simply ``neighbour_lists.invalidate(w)``.
        Verlet is an example. Kernels read parameters of the stepper from ``context.stepper``.

        Forces are summed at ``time``. A stepper that sums them within a step sets ``time`` to that instant,
        as Boris does, and stores the beginning of the step in ``time_before``, which it declares
        in ``world_fields``; ``apply_operators`` and ``AdvanceClock`` (steppers/common.py) continue from it.
        A stepper that moves particles twice reports both displacements with ``report_displacement``, which
        sets them to 0 after each. ``s.axes(s.frame, w)`` is the velocity of the frame (m/s). Forces and
        derived quantities after a step may belong to the middle of the step; the next step must not rely on
        anything else.
        """
        raise NotImplementedError(f"{type(self).__name__} must define step")
