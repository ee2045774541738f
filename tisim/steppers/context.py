"""The parts that a stepper is given, and the step that it makes from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tisim.effects.base import Constraint, Effect, Force, kinks
from tisim.operators.base import Operator

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.forces.force_sum import SumForces
    from tisim.pairs.lists import NeighbourLists
    from tisim.program.phases import Item
    from tisim.state.bound import Bound, Peers
    from tisim.state.state import State


@dataclass(frozen=True)
class StepContext:
    """The bound parts of a scene from which a step is made; a tuple of items is empty if there is nothing to
    do.

    s : device memory of the worlds. effects : all effects; ``effects.of(Source)`` returns the effects of a
    kind. stepper, control, domain : as seen by kernels. neighbour_lists : None if no part of the scene needs
    pairs. independent : whether the stepper may advance each particle by itself.

    update_lists : items that update the neighbour lists to the positions. advance_memory : items that update
    the contact histories over ``dt``, once per step. sum_forces : items that set derived quantities and sum
    the force and torque of the trial state. sum_trial_forces : the same for a state that may be far from any
    solution; the stepper must then handle forces that are not finite. Lists and forces may stand in an
    iteration, a ``Repeat``; positions must lie in the domain. force_sum : the sum by itself, for particles
    that advance one by one, and for the search for a force that fails.
    """

    s: State
    effects: Peers
    stepper: Bound[Any]
    control: Bound[Any]
    domain: Bound[Domain]
    neighbour_lists: NeighbourLists | None
    independent: bool
    update_lists: tuple[Item, ...]
    advance_memory: tuple[Item, ...]
    sum_forces: tuple[Item, ...]
    sum_trial_forces: tuple[Item, ...]
    force_sum: SumForces

    @property
    def operators(self) -> tuple[Bound[Operator], ...]:
        """Return the operators of the scene, in scene order."""
        return self.effects.of(Operator)

    @property
    def single_forces(self) -> tuple[Bound[Force], ...]:
        """Return the forces on single particles, in scene order."""
        return self.effects.of(Force)

    @property
    def constraints(self) -> tuple[Bound[Constraint], ...]:
        """Return the constraints of the scene, in scene order."""
        return self.effects.of(Constraint)

    @property
    def forced(self) -> bool:
        """Return whether there are forces at all."""
        return bool(self.force_sum.forces or self.force_sum.pair_forces)

    @property
    def turning(self) -> bool:
        """Return whether there are torques."""
        return self.force_sum.turning

    @property
    def smooth(self) -> bool:
        """Return whether forces have no kinks or jumps."""
        return not kinks([effect.data for effect in self.effects.of(Effect)], self.domain.data)


@dataclass(frozen=True)
class Buffer:
    """Device memory beside the state. memory : object whose ``bytes()`` is its size. ``what``, ``why`` : its
    content and its purpose."""

    memory: Any
    what: str
    why: str


@dataclass(frozen=True)
class Step:
    """The items of a step, in order, and the device memory allocated for them."""

    items: tuple[Item, ...]
    buffers: tuple[Buffer, ...] = ()
