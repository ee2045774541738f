"""The contract of a stepper: the order of a step."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

from tisim.components.component import Component, option
from tisim.components.domain import Domain
from tisim.effects.base import DerivedQuantity, Effect, Force, SelfConsistentQuantity
from tisim.errors import must
from tisim.sources.base import Source
from tisim.steppers.step_control import MOST_STEPS, StepControl
from tisim.worlds.program import Item
from tisim.worlds.state import Field, State


@dataclass(frozen=True)
class Parts:
    """What a stepper makes a step of. All are bound to the state; a tuple is empty where nothing is to do.

    control : decides how long the next step may be. domain, operators, near : as bound; near is None
    without a pair list. singles : forces on single particles. sources : external fields. forced, turning :
    whether there are forces, and torques. independent : whether the stepper may take each particle by itself.
    owned : memory that the stepper has allocated, what it is, and for what; it adds to the list.

    lists : bring the pair lists up to date with the positions. remember : bring up to date what touching
    pairs remember, over ``dt``; once a step. forces : settle what is to be settled, and sum force and torque
    of the trial state; trial_forces : the same for a state that may be far from any solution, where a force
    that is not finite is the stepper's to deal with. Lists and forces may stand in an iteration, a
    ``Repeat``; positions must lie in the domain. summed : the sum itself, for particles by themselves, and to
    find out which force is at fault.
    """

    s: State
    control: Any
    domain: Any
    operators: tuple[Any, ...]
    near: Any
    lists: tuple[Item, ...]
    remember: tuple[Item, ...]
    forces: tuple[Item, ...]
    trial_forces: tuple[Item, ...]
    summed: Any
    singles: tuple[Any, ...]
    sources: tuple[Any, ...]
    forced: bool
    turning: bool
    independent: bool
    owned: list[tuple[Any, str, str]] = field(default_factory=list)


def single(effect: Effect) -> bool:
    """Whether it is of each particle by itself."""
    return isinstance(effect, Force | Source | DerivedQuantity) and not isinstance(
        effect, SelfConsistentQuantity
    )


class Stepper(Component):
    """A stepper says how time advances, and its control how long the next step is: the contract of both.

    As with effects, in a kernel a parameter is a function of the world. Before the first step ``force`` and
    ``torque`` are those of the start.

    counters : names of the counters that it keeps of a world. world_quantities : names of the quantities that
    it keeps of a world. random : whether it draws random numbers, so that only statistics converge.
    """

    contract: ClassVar[bool] = True
    counters: ClassVar[tuple[str, ...]] = ()
    world_quantities: ClassVar[tuple[str, ...]] = ()
    random: ClassVar[bool] = False
    control: StepControl = option("step control, which chooses the length of the next step")

    @property
    def order(self) -> int:
        """The order of its error in dt, for smooth forces."""
        return 2

    def suits(self, effects: Sequence[Effect], domain: Domain) -> None:
        """Raise InputError when it cannot step a scene of these effects; by default it can."""

    def countable(self, effects: Sequence[Effect]) -> float:
        """Return the number of steps that it can count in a scene of these effects."""
        return MOST_STEPS

    def fewest(self, effects: Sequence[Effect], duration: float) -> float:
        """Return the number of steps that a run of this duration (s) takes at least; InputError where it is
        more than can be counted."""
        steps, most = min(self.control.fewest(duration), sys.float_info.max), self.countable(effects)
        rule = f"reached in at most {most:.3g} steps, but takes at least {steps:.3g} of {self.control.kind()}"
        must(steps <= most, "scene.duration", rule, duration)
        return max(1.0, steps)

    def independent(self, effects: Sequence[Effect]) -> bool:
        """Return whether it may take each particle by itself: by default, when they feel nothing of each
        other and only forces change them."""
        return all(single(effect) for effect in effects)

    @classmethod
    def alternatives(cls, effects: Sequence[Effect], dt: float) -> tuple[Self, ...]:
        """Return those of this kind that ``tisim cost`` tries in a scene of these effects, with steps of some
        dt (s); by default none."""
        return ()

    def rivals(self, effects: Sequence[Effect], dt: float) -> tuple[Stepper, ...]:
        """Return what ``tisim cost`` tries beside this one: by default the alternatives of every kind."""
        # By name, whatever has been imported first.
        kinds = [kind for _, kind in sorted(Stepper.known().items())]
        return tuple(stepper for kind in kinds for stepper in kind.alternatives(effects, dt))

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        """Forces summed for a particle, the mean over particles, from the counts of a run; one a step by
        default."""
        return work["particle_steps"] / particles

    def structure(self) -> tuple[Any, ...]:
        own = tuple(option for option in super().structure() if option != ("control", self.control))
        return (*own, *self.control.structure())

    def fields(self, turning: bool, independent: bool) -> tuple[str | Field, ...]:
        """Return the fields that it reads or writes in a scene with torques (``turning``), or whose particles
        do not feel each other (``independent``)."""
        return ()

    def step(self, parts: Parts) -> tuple[Item, ...]:
        """Return the items of a step, up to pair events and what operators do to the world as a whole.

        They set ``dt`` and move ``time`` on, to ``end`` at most; count ``steps`` and ``particle_steps``; set
        ``events`` to 0; once the controller has been asked, set ``approach_time`` to infinity and ``fastest``
        to 0, for its notes on the next step; call ``particle`` of each operator; put back into the domain
        what has left it; and say how far particles have moved: ``displacement`` relative to the frame, then
        ``near.moved(w)``, or simply ``near.stale[w] = 1``. Verlet is a pattern.
        """
        raise NotImplementedError(f"{type(self).__name__} must define step")
