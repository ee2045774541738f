"""The phases of a step, put together from the bound parts of a scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from tisim.components.domain import Domain
from tisim.effects.base import DerivedQuantity, Effect, Force, PairEvent, PairForce, SelfConsistentQuantity
from tisim.interactions.collision_rounds import Rounds
from tisim.interactions.contact_history import ContactHistory, UpdateContactHistory, memory_fields
from tisim.interactions.contact_list import ClearContacts, ContactList, FindContacts, FindContactsAgain
from tisim.interactions.failure_attribution import FailureAttribution
from tisim.interactions.force_sum import FORCE, TORQUE, SumForces, SumForcesAgain, SumTrialForces, turning
from tisim.interactions.rearrangement import Rearrange
from tisim.interactions.self_consistent import SelfConsistentSolver, solver
from tisim.neighbours.cell_list import list_phases
from tisim.neighbours.full_list import FullNeighbourList
from tisim.neighbours.pair_list import NeighbourList
from tisim.operators.base import Operator
from tisim.steppers.base import Stepper
from tisim.steppers.common import FinishStep
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.step_control import StepControl
from tisim.worlds.bound import Bound, Peers
from tisim.worlds.fields import Field
from tisim.worlds.program import Item
from tisim.worlds.state import State


def needed_fields(effects: Sequence[Effect], stepper: Stepper) -> dict[str | Field, str]:
    """What a scene of these needs beyond the core -> the part that needs it, in order."""
    needed: list[tuple[str | Field, str]] = []
    if any(isinstance(effect, Force | PairForce) for effect in effects):
        needed.append((FORCE, "forces"))
    if turning(effects):
        needed += [(TORQUE, "torques"), ("spin", "torques")]
    for effect in effects:
        needed += [(need, effect.label) for need in effect.required_fields()]
        if isinstance(effect, PairForce):
            needed += [(field, effect.label) for field in memory_fields(effect)]
    wanted = stepper.fields(turning(effects), stepper.independent(effects))
    needed += [(need, stepper.kind()) for need in wanted]
    users: dict[str | Field, list[str]] = {}
    for need, who in needed:
        users.setdefault(need, []).append(who)
    return {need: ", ".join(dict.fromkeys(names)) for need, names in users.items()}


def declared(effects: Sequence[Effect], stepper: Stepper, what: str) -> tuple[str, ...]:
    """Names of the ``counters``, ``world_quantities`` or ``flags`` that the parts of a scene declare, each
    once."""
    parts: tuple[Any, ...] = (*effects, stepper, stepper.control)
    return tuple(dict.fromkeys(name for part in parts for name in getattr(part, what, ())))


class Assembly:
    """What a step of a scene consists of.

    step : the items of a step. first : those that prepare the first one.
    failure_attribution : finds the force that has stopped a world.
    buffers : what has been allocated beside the state.
    """

    def __init__(
        self,
        s: State,
        effects: Peers,
        stepper: Bound[Stepper],
        domain: Bound[Domain],
        control: Bound[StepControl],
    ) -> None:
        self.s, self.domain, self.effects = s, domain, effects
        events, operators = effects.of(PairEvent), effects.of(Operator)
        short_ranged = tuple(e for e in effects.of(PairForce, SelfConsistentQuantity) if e.data.short_ranged)
        surveyed = bool(events) or control.data.watches_pairs
        listed = surveyed or bool(short_ranged)
        self.neighbour_list = near = NeighbourList(s, domain, short_ranged) if listed else None
        self.full_list = FullNeighbourList(near) if near and short_ranged else None
        contacts = ContactList(s, domain, events) if surveyed else None
        self.derived_solvers = tuple(
            solver(s, effect, domain, self.full_list) for effect in effects.of(DerivedQuantity)
        )
        lists = self.full_list.phases() if self.full_list else list_phases(near) if near else ()
        context = StepContext(
            s=s,
            effects=effects,
            stepper=stepper,
            control=control,
            domain=domain,
            neighbour_list=near,
            independent=stepper.data.independent([effect.data for effect in effects]),
            update_lists=lists,
            update_history=self._history(),
            sum_forces=self._summed(SumForces),
            sum_trial_forces=self._summed(SumTrialForces),
            force_sum=self._sum(SumForces),
        )
        self.failure_attribution = FailureAttribution(context.force_sum)
        own: Step = stepper.data.step(context)
        step, first = [*own.items], [*lists, *context.sum_forces]
        if near and contacts:
            survey = FindContacts(near, contacts, control)
            step += [ClearContacts(contacts), survey]
            first += [ClearContacts(contacts), survey]
        if events and contacts:
            step += [Rounds(contacts)]
        if events or operators:
            step += [Rearrange(s, domain, operators, near)]
            if near and contacts and control.data.watches_pairs:
                step += [*lists, FindContactsAgain(near, contacts, control)]
            if context.sum_forces:
                step += [*lists, *self._summed(SumForcesAgain)]
        self.step: tuple[Item, ...] = (*step, FinishStep(s))
        self.first: tuple[Item, ...] = tuple(first)
        pairs = "impacts, step control"
        beside = (
            (near, "pair list", pairs if surveyed else "short-ranged forces"),
            (self.full_list, "other half of the pair list", "short-ranged forces"),
            (contacts, "contact list", pairs),
        )
        self.buffers = (
            *(Buffer(memory, what, why) for memory, what, why in beside if memory is not None),
            *self._sweeps(),
            *own.buffers,
        )

    def _sweeps(self) -> Iterator[Buffer]:
        for one in self.derived_solvers:
            if isinstance(one, SelfConsistentSolver):
                quantity = one.effect.data
                yield Buffer(one, f"sweeps of {quantity.quantity}", quantity.label)

    def _history(self) -> tuple[UpdateContactHistory, ...]:
        """Give each effect with a memory what it reads it with, and bring it up to date."""
        updates = []
        for effect in self.effects.of(PairForce):
            if memory_fields(effect.data) and self.full_list:
                effect.past = ContactHistory(self.s, effect.data)
                updates.append(UpdateContactHistory(self.s, self.domain, effect, self.full_list))
        return tuple(updates)

    def _summed(self, kind: type[SumForces]) -> tuple[Item, ...]:
        """Set derived quantities, then sum the forces."""
        items: list[Item] = []
        for part in self.derived_solvers:
            items += part.phases(again=kind.conditional, trial=kind.trial)
        if self.effects.of(Force, PairForce):
            items.append(self._sum(kind))
        return tuple(items)

    def _sum(self, kind: type[SumForces]) -> SumForces:
        return kind(self.s, self.domain, self.effects, self.full_list, self.derived_solvers)
