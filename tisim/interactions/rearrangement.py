"""What follows a step as a whole: operators act on the world, and slots of removed particles are filled."""

from typing import Any

from tisim.backend.taichi import ti
from tisim.components.domain import Domain
from tisim.interactions.pair_chunks import PairChunks
from tisim.interactions.rebuild_pairs import StoreMemory
from tisim.neighbours.lists import NeighbourLists
from tisim.worlds.bound import Bound
from tisim.worlds.phases import Phase
from tisim.worlds.state import State


class StoreBefore(StoreMemory):
    """Before indices move, this phase stores what pairs remember with the particles."""

    def __init__(self, pairs: PairChunks, operators: tuple[Bound[Any], ...]) -> None:
        super().__init__(pairs)
        self.operators = tuple(operator for operator in operators if operator.data.offers("world"))

    @ti.func
    def when(self, w):
        due = self.s.changed[w]
        for operator in ti.static(self.operators):
            due = ti.max(due, operator.acts(self.s, w))
        return ti.min(due, self.p.unsaved[w])


class Rearrange(Phase):
    """This phase lets operators act on the world as a whole, and fills the slots of removed particles from
    the end."""

    def __init__(
        self,
        s: State,
        domain: Bound[Domain],
        operators: tuple[Bound[Any], ...],
        lists: NeighbourLists | None,
    ) -> None:
        self.s, self.domain = s, domain
        self.lists, self.listed = lists, lists is not None
        self.operators = tuple(operator for operator in operators if operator.data.offers("world"))

    @ti.func
    def run(self, w, _k):
        s = self.s
        # Before operators too: a slot that a merger has freed has room for a fragment.
        for turn in range(2):
            if turn == 1:
                for operator in ti.static(self.operators):
                    if operator.acts(s, w) > 0:
                        operator.world(s, w)
            self.fill(w)
        if s.events[w] > 0:
            # What the survey told the controller is no longer true.
            s.approach_time[w], s.fastest[w] = ti.math.inf, 0.0

    @ti.func
    def fill(self, w):
        s = self.s
        if s.changed[w] > 0:
            i = 0
            count = s.count[w]
            while i < count:
                if s.mass[w, i] > 0.0:
                    self.domain.put(s, w, i, s.position[w, i], s.time[w])
                    i += 1
                else:
                    count -= 1
                    if i < count:
                        s.copy(w, count, i)
            s.count[w] = count
            s.changed[w] = 0
            s.events[w] = 1
            if ti.static(self.listed):
                self.lists.invalidate(w)
