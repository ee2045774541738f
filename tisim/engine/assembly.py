"""The phases of a step, put together from the bound parts of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tisim.effects.base import DerivedQuantity, Effect, Force, PairEvent, PairForce, SelfConsistentQuantity
from tisim.interactions.collision_rounds import (
    ClearContacts,
    ContactList,
    FindContacts,
    FindContactsAgain,
    Rearrange,
    Rounds,
)
from tisim.interactions.contact_history import ContactHistory, UpdateContactHistory, memory_fields
from tisim.interactions.failure_attribution import FailureAttribution
from tisim.interactions.force_sum import FORCE, TORQUE, SumForces, SumForcesAgain, SumTrialForces, turning
from tisim.interactions.self_consistent import solver
from tisim.neighbours.cell_list import list_phases
from tisim.neighbours.full_list import FullNeighbourList
from tisim.neighbours.pair_list import NeighbourList
from tisim.operators.base import Operator
from tisim.sources.base import Source
from tisim.steppers.base import Parts, Stepper
from tisim.steppers.common import FinishStep
from tisim.worlds.program import Item
from tisim.worlds.state import Field, State


def _of(effects: Sequence[Effect], kind: type) -> tuple[Any, ...]:
    return tuple(effect for effect in effects if isinstance(effect, kind))


def needed_fields(effects: Sequence[Effect], stepper: Stepper) -> dict[str | Field, str]:
    """What a scene of these needs beyond the core -> the part that needs it, in order."""
    needed: list[tuple[str | Field, str]] = []
    forces, pair_forces = _of(effects, Force), _of(effects, PairForce)
    if forces or pair_forces:
        needed.append((FORCE, "forces"))
    if turning(forces, pair_forces):
        needed += [(TORQUE, "torques"), ("spin", "torques")]
    for effect in effects:
        needed += [(need, effect.label) for need in effect.required_fields()]
        if isinstance(effect, PairForce):
            needed += [(field, effect.label) for field in memory_fields(effect)]
    wanted = stepper.fields(turning(forces, pair_forces), stepper.independent(effects))
    needed += [(need, stepper.kind()) for need in wanted]
    users: dict[str | Field, list[str]] = {}
    for need, who in needed:
        users.setdefault(need, []).append(who)
    return {need: ", ".join(dict.fromkeys(names)) for need, names in users.items()}


def declared(effects: Sequence[Effect], stepper: Stepper, what: str) -> tuple[str, ...]:
    """Names of the counters (``counters``) or quantities of a world (``world_quantities``) of a scene, each
    once."""
    parts: tuple[Any, ...] = (*effects, stepper, stepper.control)
    return tuple(dict.fromkeys(name for part in parts for name in getattr(part, what, ())))


class Assembly:
    """What a step of a scene consists of.

    step : the items of a step. first : those that prepare the first one.
    failure_attribution : finds the force that has stopped a world.
    memory : what has been allocated beside the state, by what it is and for what.
    """

    def __init__(
        self, s: State, stepper: Stepper, effects: tuple[Effect, ...], domain: Any, control: Any
    ) -> None:
        self.s, self.domain = s, domain
        events, operators = _of(effects, PairEvent), _of(effects, Operator)
        self.forces, self.pair_forces = _of(effects, Force), _of(effects, PairForce)
        mutual = _of(effects, SelfConsistentQuantity)
        short_ranged = tuple(e for e in (*self.pair_forces, *mutual) if e.short_ranged)
        surveyed = bool(events) or control.watches_pairs
        self.near = near = NeighbourList(s, domain, short_ranged) if surveyed or short_ranged else None
        self.full_list = FullNeighbourList(near) if near and short_ranged else None
        self.contacts = contacts = ContactList(s, domain, events) if surveyed else None
        self.derived_solvers = tuple(
            solver(s, e, domain, self.full_list) for e in _of(effects, DerivedQuantity)
        )
        self.memory: tuple[tuple[Any, str, str], ...] = tuple(
            (part, name, why)
            for part, name, why in (
                (near, "pair list", "impacts, step control" if surveyed else "short-ranged forces"),
                (self.full_list, "other half of the pair list", "short-ranged forces"),
                (contacts, "contact list", "impacts, step control"),
                *(
                    (a, f"sweeps of {a.effect.quantity}", a.effect.label)
                    for a in self.derived_solvers
                    if isinstance(a.effect, SelfConsistentQuantity)
                ),
            )
            if part is not None
        )

        lists = self.full_list.phases() if self.full_list else list_phases(near) if near else ()
        parts = Parts(
            s=s,
            control=control,
            domain=domain,
            operators=operators,
            near=near,
            lists=lists,
            remember=self._remember(),
            forces=self._summed(SumForces),
            forced=bool(self.forces or self.pair_forces),
            trial_forces=self._summed(SumTrialForces),
            summed=self._sum(SumForces),
            singles=self.forces,
            sources=_of(effects, Source),
            turning=turning(self.forces, self.pair_forces),
            independent=stepper.independent(effects),
        )
        self.failure_attribution = FailureAttribution(parts.summed)
        step: list[Item] = [*stepper.step(parts)]
        self.memory += tuple(parts.owned)
        first: list[Item] = [*lists, *parts.forces]
        if near and contacts:
            survey = FindContacts(near, contacts, control)
            step += [ClearContacts(contacts), survey]
            first += [ClearContacts(contacts), survey]
        if events and contacts:
            step += [Rounds(contacts)]
        if events or operators:
            step += [Rearrange(s, domain, operators, near)]
            if near and contacts and control.watches_pairs:
                step += [*lists, FindContactsAgain(near, contacts, control)]
            if parts.forces:
                step += [*lists, *self._summed(SumForcesAgain)]
        self.step: tuple[Item, ...] = (*step, FinishStep(s))
        self.first: tuple[Item, ...] = tuple(first)

    def _remember(self) -> tuple[UpdateContactHistory, ...]:
        """Give each effect with a memory what it reads it with, and bring it up to date."""
        found = []
        for effect in self.pair_forces:
            if memory_fields(effect) and self.full_list:
                effect.__dict__["past"] = ContactHistory(self.s, effect)
                found.append(UpdateContactHistory(self.s, self.domain, effect, self.full_list))
        return tuple(found)

    def _summed(self, kind: type[SumForces]) -> tuple[Item, ...]:
        """Settle what is to be settled, then sum the forces."""
        items: list[Item] = []
        for part in self.derived_solvers:
            items += part.phases(again=kind.conditional, trial=kind.trial)
        if self.forces or self.pair_forces:
            items.append(self._sum(kind))
        return tuple(items)

    def _sum(self, kind: type[SumForces]) -> SumForces:
        return kind(self.s, self.domain, self.forces, self.pair_forces, self.full_list, self.derived_solvers)
