"""Work after a step: operators act on the world, and the slots of removed particles are filled."""

from typing import Any

from tisim.backend.taichi import ti
from tisim.pairs.pair_chunks import PairChunks
from tisim.pairs.rebuild_pairs import StoreMemory
from tisim.population.vacated_slots import FillSlots, VacatedSlots
from tisim.program.phases import Item, Phase
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.bound import Bound
from tisim.state.state import State


def rearrange(slots: VacatedSlots, operators: tuple[Bound[Any], ...]) -> tuple[Item, ...]:
    """Return the items in which operators act on the world and vacated slots are filled."""
    s, fill = slots.s, FillSlots(slots)
    acts = tuple(item for operator in acting(operators) for item in act(s, operator))
    # Slots are also filled before the operators act, so that a slot freed by a merger is free for a fragment.
    return (fill, *acts, fill, ForgetPairs(s)) if acts else (fill, ForgetPairs(s))


def acting(operators: tuple[Bound[Any], ...]) -> tuple[Bound[Any], ...]:
    """Return the operators that act on whole worlds."""
    return tuple(operator for operator in operators if operator.data.acts_on_worlds())


def active(operators: tuple[Bound[Any], ...]) -> tuple[Bound[Any], ...]:
    """Return the operators that act on worlds in phases of their own."""
    return tuple(operator for operator in acting(operators) if operator.action is not None)


def act(s: State, operator: Bound[Any]) -> tuple[Item, ...]:
    """Return the items of an operator: the sum of its terms, its action on the world, and its own phases."""
    items: tuple[Item, ...] = ()
    if operator.data.terms > 0:
        operator.sums = BlockSums(s, operator.data.terms)
        items += (SumTerms(operator),)
    if operator.data.offers("world"):
        items += (ActOnWorld(s, operator),)
    operator.action = operator.data.world_action(operator, s)
    return items if operator.action is None else (*items, *operator.action.phases())


class StoreBefore(StoreMemory):
    """This phase stores the contact history on the particles before indices change."""

    def __init__(self, pairs: PairChunks, operators: tuple[Bound[Any], ...]) -> None:
        super().__init__(pairs)
        self.operators = acting(operators)

    @ti.func
    def when(self, w):
        due = self.s.changed[w]
        for operator in ti.static(self.operators):
            due = ti.max(due, operator.acts(self.s, w))
        return ti.min(due, self.p.unsaved[w])


class SumTerms(PerBlock):
    """This phase sums the terms of an operator over the particles of a world in which it acts."""

    conditional = True

    def __init__(self, operator: Bound[Any]) -> None:
        super().__init__(operator.sums)
        self.operator = operator

    @ti.func
    def when(self, w):
        return self.operator.acts(self.s, w)

    @ti.func
    def each(self, w, i):
        terms = ti.Vector.zero(ti.f64, self.sums.terms)
        # A particle removed by an earlier operator has no mass.
        if self.s.mass[w, i] > 0.0:
            terms = self.operator.each(self.s, w, i)
        return terms


class ActOnWorld(Phase):
    """This phase lets an operator act on the world."""

    def __init__(self, s: State, operator: Bound[Any]) -> None:
        self.s, self.operator = s, operator

    @property
    def name(self) -> str:
        return f"{super().name} {self.operator.data.label}"

    @ti.func
    def run(self, w, _k):
        if self.operator.acts(self.s, w) > 0:
            self.operator.world(self.s, w)


class ForgetPairs(Phase):
    """This phase resets the step control's data of near pairs after events, as they are outdated."""

    def __init__(self, s: State) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        s = self.s
        if s.events[w] > 0:
            s.approach_time[w], s.fastest[w] = ti.math.inf, 0.0
