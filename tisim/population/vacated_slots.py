"""Slots of removed particles are filled from the end, so that the live particles stay contiguous."""

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.pairs.lists import NeighbourLists
from tisim.program.phases import PerParticle, Phase, Repeat
from tisim.program.scans import PrefixSum
from tisim.state.bound import Bound
from tisim.state.state import State


@ti.data_oriented
class VacatedSlots:
    """The vacated slots of a world are filled by its last particles: the first slot by the last particle.

    alive : whether a slot has a live particle; later the number of live particles up to it.
    last : the slots of the particles that move, from the end.
    """

    def __init__(self, s: State, domain: Bound[Domain], lists: NeighbourLists | None) -> None:
        self.s, self.domain = s, domain
        self.lists, self.listed = lists, lists is not None
        self.alive, self.last = ti.field(ti.i32), ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.alive, self.last)
        self.tree = Tree(builder)
        self.sums = PrefixSum(s, PerParticle(s), self.alive, self.alive)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.sums.bytes()


class FillSlots(Repeat):
    """This item fills the slots of a world and puts all particles inside the domain.

    It runs after a particle was removed, inserted, or moved other than by a step.
    """

    usual = 0

    def __init__(self, slots: VacatedSlots) -> None:
        find = (MarkLive(slots), *slots.sums.phases(), FindLast(slots))
        super().__init__((*find, FillFromEnd(slots), EndFill(slots)))
        self.s = slots.s

    @ti.func
    def pending(self, w):
        return self.s.changed[w]


class PerSlot(PerParticle):
    """Base of the phases that loop over the slots up to the last one in use."""

    def __init__(self, slots: VacatedSlots) -> None:
        super().__init__(slots.s)
        self.slots = slots


class MarkLive(PerSlot):
    """This phase marks the slots of live particles."""

    @ti.func
    def run(self, w, i):
        self.slots.alive[w, i] = ti.cast(self.s.mass[w, i] > 0.0, ti.i32)


class FindLast(PerSlot):
    """This phase lists the live particles beyond the slots that stay in use, from the end."""

    @ti.func
    def size(self, w):
        return self.s.count[w] - self.slots.sums.total[w]

    @ti.func
    def run(self, w, k):
        slots, number = self.slots, self.slots.sums.total[w]
        i = number + k
        if self.s.mass[w, i] > 0.0:
            slots.last[w, number - slots.alive[w, i]] = i


class FillFromEnd(PerSlot):
    """This phase fills the vacated slots among those that stay in use."""

    @ti.func
    def size(self, w):
        return self.slots.sums.total[w]

    @ti.func
    def run(self, w, i):
        s, slots = self.s, self.slots
        if not s.mass[w, i] > 0.0:
            s.copy(w, slots.last[w, i - slots.alive[w, i]], i)
        slots.domain.put(s, w, i, s.position[w, i], s.time[w])


class EndFill(Phase):
    """This phase updates the particle count, records an event and invalidates the pair lists."""

    def __init__(self, slots: VacatedSlots) -> None:
        self.s, self.slots = slots.s, slots

    @ti.func
    def run(self, w, _k):
        s, slots = self.s, self.slots
        s.count[w] = slots.sums.total[w]
        s.changed[w], s.events[w] = 0, 1
        if ti.static(slots.listed):
            slots.lists.invalidate(w)
