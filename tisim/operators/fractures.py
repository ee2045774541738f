"""The fractures of a step: grains that have broken write their pieces into slots, all at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.program.phases import Item, PerParticle, Phase, Repeat, WorldAction
from tisim.program.scans import PrefixSum
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.operators.fragmentation import Fragmentation


@ti.data_oriented
class Fractures(WorldAction):
    """The new pieces of the grains of a world that have broken take the slots after the last one in use, in
    the order of the grains.

    new : of each grain how many more pieces than one it breaks into, then how many there are of all grains up
    to it.
    """

    def __init__(self, fragmentation: Bound[Fragmentation], s: State) -> None:
        self.fragmentation, self.s = fragmentation, s
        self.new = ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.new)
        self.tree = Tree(builder)
        self.sums = PrefixSum(s, PerParticle(s), self.new, self.new)

    def phases(self) -> tuple[Item, ...]:
        return (SplitGrains(self),)

    def bytes(self) -> int:
        return self.tree.bytes + self.sums.bytes()


class SplitGrains(Repeat):
    """This item splits all grains of a world that have broken."""

    usual = 0

    def __init__(self, fractures: Fractures) -> None:
        find = (CountPieces(fractures), *fractures.sums.phases())
        super().__init__((*find, SplitGrain(fractures), EndFractures(fractures)))
        self.s = fractures.s

    @ti.func
    def pending(self, w):
        return self.s.fracture_due[w]


class CountPieces(PerParticle):
    """This phase counts the new pieces of each grain."""

    def __init__(self, fractures: Fractures) -> None:
        super().__init__(fractures.s)
        self.fractures = fractures

    @ti.func
    def run(self, w, i):
        self.fractures.new[w, i] = ti.max(self.s.pieces[w, i] - 1, 0)


class SplitGrain(PerParticle):
    """This phase splits each grain that has broken; none, where there is not room for all pieces, and the
    first grain that has none stops the world."""

    def __init__(self, fractures: Fractures) -> None:
        super().__init__(fractures.s)
        self.fractures, self.fragmentation = fractures, fractures.fragmentation

    @ti.func
    def run(self, w, i):
        s, fractures, n = self.s, self.fractures, self.s.pieces[w, i]
        if n >= 2:
            s.pieces[w, i] = 0
            upto, room = fractures.new[w, i], s.room(w)
            before = upto - (n - 1)
            if fractures.sums.total[w] <= room:
                self.fragmentation.split(s, w, i, n, before)
            elif before <= room < upto:
                s.fail(w, WorldStatus.OUT_OF_ROOM, i)


class EndFractures(Phase):
    """This phase counts the new pieces as particles."""

    def __init__(self, fractures: Fractures) -> None:
        self.s, self.fractures = fractures.s, fractures

    @ti.func
    def run(self, w, _k):
        self.s.lengthen(w, self.fractures.sums.total[w])
        self.s.fracture_due[w] = 0
