"""What a stepper is given to make a step of, and what it makes of it."""

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
    """A context holds the bound parts of a scene that a step is made of; a tuple of items is empty where
    nothing is to do.

    s : device memory of the worlds. effects : all of them, ``effects.of(Source)`` those of a kind. stepper :
    the stepper itself, as kernels see it; control, domain : likewise. neighbour_lists : None where nothing
    asks for pairs. independent : whether the stepper may take each particle by itself.

    update_lists : items that bring the neighbour lists up to date with the positions. advance_memory : bring
    up to date what touching pairs remember, over ``dt``; once a step. sum_forces : set derived quantities,
    and sum force and torque of the trial state. sum_trial_forces : the same for a state that may be far from
    any solution, where a force that is not finite is the stepper's to deal with. Lists and forces may stand
    in an iteration, a ``Repeat``; positions must lie in the domain. force_sum : the sum by itself, for
    particles taken one by one, and to find out which force is at fault.
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
        """Return the forces on particles by themselves, in scene order."""
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
        """Return whether forces have no kinks or jumps on the way."""
        return not kinks([effect.data for effect in self.effects.of(Effect)], self.domain.data)


@dataclass(frozen=True)
class Buffer:
    """A buffer is device memory beside the state: ``memory`` tells its ``bytes()``; the rest says what it is,
    and for what."""

    memory: Any
    what: str
    why: str


@dataclass(frozen=True)
class Step:
    """A step is its items, in order, and the device memory that was allocated for them."""

    items: tuple[Item, ...]
    buffers: tuple[Buffer, ...] = ()
