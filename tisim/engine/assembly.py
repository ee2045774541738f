"""The phases of a step, put together from the bound parts of a scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from tisim.backend.taichi import ti
from tisim.collisions.collision_rounds import Rounds
from tisim.collisions.contact_list import ClearContacts, ContactList, FindContacts
from tisim.domains.domain import Domain
from tisim.effects.base import (
    Constraint,
    DerivedQuantity,
    Effect,
    Force,
    HardBodies,
    LongRange,
    PairEvent,
    PairForce,
    SelfConsistentQuantity,
)
from tisim.forces.failure_attribution import FailureAttribution
from tisim.forces.force_sum import (
    AdvanceParticles,
    SumForces,
    SumTrialForces,
    advance_phases,
    turning,
)
from tisim.forces.loads import FORCE, TORQUE
from tisim.operators.base import Operator
from tisim.pairs.contact_memory import ContactMemory, memory_fields
from tisim.pairs.half_list import HalfList, ListSizes
from tisim.pairs.listed_pairs import ExportedTerms, fuse, sum_phases
from tisim.pairs.lists import NeighbourLists
from tisim.pairs.near_list import NearList, update_near_list
from tisim.pairs.pair_chunks import PairChunks
from tisim.pairs.rebuild_pairs import update_pairs
from tisim.population import spatial_sort
from tisim.population.rearrangement import StoreBefore, acting, active, rearrange
from tisim.population.spatial_sort import SpatialSort
from tisim.population.vacated_slots import VacatedSlots
from tisim.program.evaluation_stage import Enter, EnterAfterEvents, EvaluationStage
from tisim.program.phases import Item
from tisim.scene.scene import Scene
from tisim.self_consistent.self_consistent import SelfConsistentSolver, solver
from tisim.state.bound import Bound, Peers
from tisim.state.fields import SHARED, Field, WorldField, names_of, resolve_fields, resolve_world_fields
from tisim.state.state import State
from tisim.steppers.base import Stepper
from tisim.steppers.common import EndStep, FinishStep, FirstStep
from tisim.steppers.constraints import begin_constraints
from tisim.steppers.context import Buffer, Step, StepContext
from tisim.steppers.step_control import FixedStep, StepControl

INTEGER = 4
"""Bytes of an index."""


def needed_fields(effects: Sequence[Effect], stepper: Stepper) -> dict[str | Field, str]:
    """Return the fields that a scene needs beyond the core fields, in order -> the part that needs each."""
    needed: list[tuple[str | Field, str]] = []
    if any(isinstance(effect, Force | PairForce) for effect in effects):
        needed.append((FORCE, "forces"))
    if turning(effects):
        needed += [(TORQUE, "torques"), ("spin", "torques")]
    for effect in effects:
        needed += [(need, effect.label) for need in effect.required_fields()]
        if isinstance(effect, PairForce):
            needed += [(field, effect.label) for field in memory_fields(effect)]
        if isinstance(effect, Force):
            needed += [(field, effect.label) for field in effect.memory_fields(effects)]
    needed += [(need, stepper.kind()) for need in stepper.fields(effects)]
    users: dict[str | Field, list[str]] = {}
    for need, who in needed:
        users.setdefault(need, []).append(who)
    return {need: ", ".join(dict.fromkeys(names)) for need, names in users.items()}


def needed_world_fields(
    effects: Sequence[Effect], stepper: Stepper, taken: Sequence[str]
) -> tuple[WorldField, ...]:
    """Return the world fields of a scene; InputError is raised for a name that is ``taken``."""
    of_effects = [field for effect in effects for field in effect.required_world_fields()]
    of_stepper = (*stepper.world_fields, *stepper.control.world_fields)
    return resolve_world_fields(of_effects, of_stepper, taken)


def units(scene: Scene) -> dict[str, str]:
    """Return the unit of each particle quantity of a scene, by name."""
    fields = resolve_fields((*SHARED, *needed_fields(scene.acting(), scene.stepper)))
    return {field.name: field.unit for field in fields}


def measured(effects: Sequence[Effect]) -> dict[str, str]:
    """Return the units of all measures of the effects of a scene, by name."""
    return {name: unit for effect in effects for name, unit in effect.measured().items()}


def picks_pairs(effects: Sequence[Effect], stepper: Stepper) -> bool:
    """Return whether every pair sum of the scene runs over listed pairs."""
    kinds = PairForce | SelfConsistentQuantity | HardBodies
    pairwise = [effect for effect in effects if isinstance(effect, kinds)]
    return bool(pairwise) and not stepper.all_pairs and all(effect.short_ranged for effect in pairwise)


class Assembly:
    """An assembly holds the items of a step of a scene.

    step : the items of a step. first : the items that prepare the first step.
    sort : sorts particles in memory between steps; None if sorting does not pay.
    failure_attribution : finds the force that has stopped a world.
    buffers : memory allocated in addition to the state.
    """

    def __init__(
        self,
        s: State,
        effects: Peers,
        stepper: Bound[Stepper],
        domain: Bound[Domain],
        control: Bound[StepControl],
        sizes: ListSizes,
    ) -> None:
        self.s, self.domain, self.effects, self.sizes = s, domain, effects, sizes
        events, operators = effects.of(PairEvent), effects.of(Operator)
        kinds = PairForce, SelfConsistentQuantity, HardBodies
        short_ranged = tuple(e for e in effects.of(*kinds) if e.data.short_ranged)
        surveyed = bool(events) or control.data.watches_pairs
        near = NearList(s, domain, sizes.near) if surveyed else None
        self.pairs = self._listed(short_ranged, sizes) if short_ranged else None
        self.lists = NeighbourLists(s, near, self.pairs) if near or self.pairs else None
        contacts = ContactList(s, domain, events) if surveyed else None
        self.derived_solvers = tuple(
            solver(s, effect, domain, self.pairs) for effect in effects.of(DerivedQuantity)
        )
        for law in effects.of(LongRange):
            law.sum = law.data.long_range_sum(law, s, domain)
        self.long_range = {law.data.label: law.sum for law in effects.of(LongRange)}
        # Trial states use the same long-range phases, so these are compiled once. The long-range sums of
        # self-consistent quantities are part of their sweeps.
        final = (law.sum for law in effects.of(LongRange) if not isinstance(law.data, SelfConsistentQuantity))
        self._long_range_items = tuple(item for one in final for item in one.phases())
        for effect in effects:
            for name, value in effect.data.bind_fields(s).items():
                setattr(effect, name, value)
        force_sum = SumForces(*self._sees())
        listed = any(isinstance(effect.data, PairForce) for effect in short_ranged)
        self.exported = ExportedTerms(self.pairs, force_sum.components) if self.pairs and listed else None
        pairs = update_pairs(self.pairs) if self.pairs else ()
        lists = (*(update_near_list(near) if near else ()), *pairs)
        derived, forces = self._derived(), self._forces(force_sum)
        context = StepContext(
            s=s,
            effects=effects,
            stepper=stepper,
            control=control,
            domain=domain,
            neighbour_lists=self.lists,
            independent=stepper.data.independent([effect.data for effect in effects]),
            update_lists=lists,
            advance_memory=self._advance(force_sum, pairs),
            sum_forces=(*derived, *forces),
            sum_trial_forces=(*self._derived(trial=True), *self._forces(SumTrialForces(*self._sees()))),
            force_sum=force_sum,
        )
        self.failure_attribution = FailureAttribution(context.force_sum)
        own: Step = stepper.data.step(context)
        known = (FirstStep(s, control),) if isinstance(control.data, FixedStep) and context.forced else ()
        measuring = (e for e in effects if names_of(e.data.required_world_fields(), "measure"))
        keepers = tuple(e for e in measuring if e.data.offers("end_step"))
        ends = (EndStep(s, keepers),) if keepers else ()
        # Items that are the same objects as in the step are compiled once.
        items, again = fuse(own.items, forces)
        begin = (*begin_constraints(s, effects.of(Constraint)), *known)
        step, first = [*items, *ends], [*begin, *lists, *derived]
        if known and force_sum.remembers:
            first += [Enter(s, EvaluationStage.AHEAD), *again]
        first += [Enter(s, EvaluationStage.START), *again, Enter(s, EvaluationStage.STEP), *ends]
        if near and contacts:
            survey = FindContacts(near, contacts, control)
            step += [ClearContacts(contacts), survey]
            first += [ClearContacts(contacts), survey]
        if events and contacts:
            step += [Rounds(contacts)]
        slots = VacatedSlots(s, domain, self.lists) if events or operators else None
        if slots:
            if self.pairs and self.pairs.memories:
                step += [StoreBefore(self.pairs, operators)]
            step += rearrange(slots, operators)
            surveys = (survey,) if near and contacts and control.data.watches_pairs else ()
            if anew := (*surveys, *derived, *again):
                step += [*lists, EnterAfterEvents(s), *anew, Enter(s, EvaluationStage.STEP)]
        self.step: tuple[Item, ...] = (*step, FinishStep(s))
        self.first: tuple[Item, ...] = tuple(first)
        # Events tell pairs apart by index, so particles must not move in memory.
        ordered = events or not all(one.data.any_order for one in acting(operators))
        sorts = s.records and not ordered and s.capacity >= spatial_sort.SORTED_FROM
        self.sort = SpatialSort(self.pairs, self.lists) if sorts and self.pairs and self.lists else None
        sudden, steady = "impacts, step control", "short-ranged forces"
        beside = (
            (near, "neighbour list", sudden),
            (contacts, "contact list", sudden),
            (self.pairs, "pair list", steady),
            (self.exported, "forces between chunks", steady),
            (self.sort, "sorting by position", steady),
            (slots, "slots of removed particles", "removals"),
        )
        self.buffers = (
            *(Buffer(memory, what, why) for memory, what, why in beside if memory is not None),
            *self._sweeps(),
            *(Buffer(memory, "long-range sum", label) for label, memory in self.long_range.items()),
            *(Buffer(one.action, "action on worlds", one.data.label) for one in active(operators)),
            *own.buffers,
        )

    def crowding(self, w: int) -> str:
        """Return a text that names a particle with overflowed lists, and the number of particles near it."""
        s, lists = self.s, self.lists
        longest = [int(one.longest.to_numpy()[w]) for one in lists.rows()] if lists else [0]
        who = int(s.read("failing_particle")[w])
        place = s.snapshot(("id", "position"))
        rows = place["position"][w][place["id"][w] == who]
        where = "at ({:.4g}, {:.4g}, {:.4g}) m".format(*rows[0]) if len(rows) else "that has left"
        return f"particle {who} {where}, one of those that have up to {max(longest)} others near them"

    def list_bytes(self, sizes: ListSizes) -> int:
        """Return the device memory (bytes) that pair lists of these sizes would take."""
        s, each = self.s, 0
        if self.lists and self.lists.near:
            each += INTEGER * sizes.near
        if self.pairs:
            values = sum(one.size for one in self.pairs.memories)
            values += self.exported.components if self.exported else 0
            of_pair = 4 * INTEGER + (8 if s.real == ti.f64 else 4) * values
            each += INTEGER * sizes.row + of_pair * sizes.mean
        return each * s.worlds * s.capacity

    def _sweeps(self) -> Iterator[Buffer]:
        for one in self.derived_solvers:
            if isinstance(one, SelfConsistentSolver):
                quantity = one.effect.data
                yield Buffer(one, f"sweeps of {quantity.quantity}", quantity.label)

    def _listed(self, laws: tuple[Bound[Any], ...], sizes: ListSizes) -> PairChunks:
        """Return the listed pairs of these laws, and give each law its contact history."""
        memories = []
        for law in laws:
            if isinstance(law.data, PairForce) and memory_fields(law.data):
                law.past = ContactMemory(self.s, law)
                memories.append(law.past)
        half_list = HalfList(self.s, self.domain, laws, self.effects.of(Constraint), sizes)
        pairs = PairChunks(half_list, tuple(memories))
        if memories:
            self.s.before_reading.append(pairs.store_memory)
        return pairs

    def _advance(self, force_sum: SumForces, pairs: tuple[Item, ...]) -> tuple[Item, ...]:
        """Return the items that update the contact history and the memory of single particles after a trial.

        They use the pairs listed at the end of the step, as the last trial state may lie farther from it.
        """
        items: list[Item] = []
        if self.pairs and self.pairs.memories and self.exported:
            items += [*pairs, *advance_phases(force_sum, self.exported)]
        if any(force.data.offers("load") for force in self.effects.of(Force)):
            items.append(AdvanceParticles(force_sum))
        return tuple(items)

    def _derived(self, trial: bool = False) -> tuple[Item, ...]:
        """Return the items that set derived quantities, then the items of the long-range sums."""
        items = tuple(item for part in self.derived_solvers for item in part.phases(trial))
        return (*items, *self._long_range_items)

    def _forces(self, total: SumForces) -> tuple[Item, ...]:
        """Return the items that sum the forces, if the scene has any."""
        return sum_phases(total, self.exported) if self.effects.of(Force, PairForce) else ()

    def _sees(self) -> tuple[Any, ...]:
        """Return the arguments of a force sum."""
        return self.s, self.domain, self.effects, self.pairs, self.derived_solvers
