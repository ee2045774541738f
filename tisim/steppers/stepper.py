"""The contract of a stepper: the order of a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from tisim.program import Item
from tisim.spec import Spec
from tisim.state import Field, State
from tisim.steppers.controller import ApproachTime, Controller


@dataclass(frozen=True)
class Parts:
    """What a stepper makes a step of. All are bound to the state; a tuple is empty where nothing is to do.

    control : decides how long the next step may be. domain, operators, near : as bound; near is None
    without a pair list. forced, turning : whether there are forces, and torques.

    lists : bring the pair lists up to date with the positions. remember : bring up to date what touching
    pairs remember, over ``dt``; once a step. forces : settle what is mutual, and sum force and torque of the
    trial state. Lists and forces may stand in an iteration, a ``Repeat``; positions must lie in the domain.
    """

    s: State
    control: Any
    domain: Any
    operators: tuple[Any, ...]
    near: Any
    lists: tuple[Item, ...]
    remember: tuple[Item, ...]
    forces: tuple[Item, ...]
    forced: bool
    turning: bool


class Stepper(Spec):
    """How time advances. ``control`` chooses the length of the next step.

    As with effects, ``needs`` names fields, ``counts`` counters, ``keeps`` quantities of a world, and in a
    kernel a parameter is a function of the world. Before the first step ``force`` and ``torque`` are those of
    the start.
    """

    contract: ClassVar[bool] = True
    needs: ClassVar[tuple[str | Field, ...]] = ()
    counts: ClassVar[tuple[str, ...]] = ()
    keeps: ClassVar[tuple[str, ...]] = ()
    control: Controller = ApproachTime()

    def structure(self) -> tuple[Any, ...]:
        own = tuple(option for option in super().structure() if option != ("control", self.control))
        return (*own, *self.control.structure())

    def step(self, parts: Parts) -> tuple[Item, ...]:
        """The items of a step, up to pair events and what operators do to the world as a whole.

        They set ``dt`` and move ``time`` on, to ``end`` at most; count ``steps`` and ``particle_steps``; set
        ``events`` to 0; once the controller has been asked, set ``approach_time`` to infinity and ``fastest``
        to 0, for its notes on the next step; call ``particle`` of each operator; put back into the domain
        what has left it; and say how far particles have moved: ``stride`` relative to the frame, then
        ``near.moved(w)``, or simply ``near.stale[w] = 1``. Verlet is a pattern.
        """
        raise NotImplementedError(f"{type(self).__name__} must define step")
