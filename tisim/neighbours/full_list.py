"""The other half of the pair list: for each particle, the larger neighbours that have listed it.

A pair is listed once, by its larger member, which suits events. A force has to reach both members; so that
it can be gathered without atomics and in a fixed order, each list is turned around and both halves are
sorted by index. A sum over neighbours then has the same order, and the same bits, whenever the list was made.
"""

from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.neighbours.cell_list import list_phases
from tisim.neighbours.pair_list import NeighbourList
from tisim.worlds.program import PerParticle, Phase


@ti.data_oriented
class FullNeighbourList:
    """Both halves of the neighbours of every particle."""

    def __init__(self, neighbour_list: NeighbourList) -> None:
        self.neighbour_list, self.s = neighbour_list, neighbour_list.s
        self.larger_index, self.larger_count = ti.field(ti.i32), ti.field(ti.i32)
        builder = ti.FieldsBuilder()
        particles = builder.dense(ti.i, self.s.worlds).dense(ti.j, self.s.capacity)
        particles.place(self.larger_count)
        particles.dense(ti.k, neighbour_list.room).place(self.larger_index)
        self.tree = Tree(builder)

    def phases(self) -> tuple[Phase, ...]:
        """Bring both halves up to date where it is due."""
        *others, last = list_phases(self.neighbour_list)
        return (*others, ClearReverseList(self), BuildReverseList(self), SortNeighbours(self), last)

    def bytes(self) -> int:
        """Device memory, in bytes."""
        return 4 * self.s.worlds * self.s.capacity * (1 + self.neighbour_list.room)

    @ti.func
    def size(self, w, i):
        """How many candidates ``candidate`` offers particle i."""
        return self.neighbour_list.size(w, i) + self.others(w, i)

    @ti.func
    def candidate(self, w, i, k):
        """The k-th particle that may be a neighbour of i, those it owns first; i itself where there is none.

        One loop over both halves: what is done with a pair is compiled once.
        """
        j, own = 0, self.neighbour_list.size(w, i)
        if k < own:
            j = self.neighbour_list.candidate(w, i, k)
        if k >= own:
            j = self.owner(w, i, k - own)
        return j

    @ti.func
    def others(self, w, i):
        """How many candidates ``owner`` offers particle i."""
        n = self.s.count[w]
        if n > self.s.listed_above[w] and self.larger_count[w, i] >= 0:
            n = self.larger_count[w, i]
        return n

    @ti.func
    def owner(self, w, i, k):
        """The k-th particle that may be a neighbour and own the pair; i itself where there is none."""
        j = k
        if self.s.count[w] > self.s.listed_above[w] and self.larger_count[w, i] >= 0:
            j = self.larger_index[w, i, k]
        elif k == i or not self.neighbour_list.owns(w, k, i):
            j = i
        return j


class WhenListIsDue(PerParticle):
    """Work on the lists of a world when they are due."""

    conditional = True

    def __init__(self, full_list: FullNeighbourList) -> None:
        super().__init__(full_list.s)
        self.m = full_list

    @ti.func
    def when(self, w):
        return self.m.neighbour_list.stale[w] > 0 and self.s.count[w] > self.s.listed_above[w]


class ClearReverseList(WhenListIsDue):
    """Nobody has been listed yet."""

    @ti.func
    def run(self, w, i):
        self.m.larger_count[w, i] = 0


class BuildReverseList(WhenListIsDue):
    """Tell each listed particle who has listed it; those that look at all do so too."""

    @ti.func
    def run(self, w, i):
        n, m = self.m.neighbour_list, self.m
        for k in range(n.size(w, i)):
            j = n.candidate(w, i, k)
            if j != i:
                slot = ti.atomic_add(m.larger_count[w, j], 1)
                if slot < n.room:
                    m.larger_index[w, j, slot] = i


class SortNeighbours(WhenListIsDue):
    """Order both halves by index; mark those that are too many."""

    @ti.func
    def run(self, w, i):
        n, m = self.m.neighbour_list, self.m
        self.order(n.neighbour_index, w, i, n.neighbour_count[w, i])
        if m.larger_count[w, i] > n.room:
            m.larger_count[w, i] = -1
        self.order(m.larger_index, w, i, m.larger_count[w, i])

    @ti.func
    def order(self, column: ti.template(), w, i, size):  # type: ignore[valid-type]
        for a in range(1, size):
            value, b = column[w, i, a], a - 1
            while b >= 0:
                if column[w, i, b] > value:
                    column[w, i, b + 1] = column[w, i, b]
                    b -= 1
                else:
                    break
            column[w, i, b + 1] = value
