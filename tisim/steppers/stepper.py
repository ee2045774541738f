"""The contract of a stepper: the phases it puts around the sum of forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from tisim.program import Phase, Repeat
from tisim.spec import Spec
from tisim.state import State
from tisim.steppers.controller import ApproachTime, Controller


@dataclass(frozen=True)
class Parts:
    """What a stepper works on: bound control, domain and operators; near is None without a pair list."""

    s: State
    control: Any
    domain: Any
    operators: tuple[Any, ...]
    near: Any
    forced: bool


class Stepper(Spec):
    """How time advances. ``control`` chooses the length of the next step.

    ``before_forces`` brings positions and time to the end of the step, ``after_forces`` velocities; an
    iteration is a ``Repeat`` among them. Pair lists are brought up to date in between. ``forced`` says
    whether the scene has forces at all.
    """

    contract: ClassVar[bool] = True
    control: Controller = ApproachTime()

    def structure(self) -> tuple[Any, ...]:
        return (*super().structure()[:1], *self.control.structure())

    def before_forces(self, parts: Parts) -> tuple[Phase | Repeat, ...]:
        """Phases up to the new positions."""
        raise NotImplementedError(f"{type(self).__name__} must define before_forces")

    def after_forces(self, parts: Parts) -> tuple[Phase | Repeat, ...]:
        """Phases once ``force`` holds the forces at the new positions."""
        raise NotImplementedError(f"{type(self).__name__} must define after_forces")
