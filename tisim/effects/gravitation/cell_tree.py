"""A tree of cells over particles, rebuilt from their positions in parallel and bitwise reproducible.

Particles are sorted along Hilbert's curve and divided into leaves of a fixed number of particles. A fixed
number of successive leaves form a cell of the next level, and so on up to one cell that contains all
particles. The tree needs no pointers: the indices of all cells follow from the number of particles alone.
Each cell has a bounding box around its particles.
"""

from typing import Any

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.numerics.hilbert import CURVE_BITS, hilbert_index
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import Item, PerParticle, Phase
from tisim.program.radix_sort import RadixSort
from tisim.state.state import State

LEAF = 16
"""Number of particles in a leaf; the last one of a world may have fewer."""
FAN = 4
"""Number of cells of the level below in a cell; the last one of a level may have fewer."""
BOX_BLOCK = 512
"""Number of particles whose bounding box is found in one task."""


@ti.data_oriented
class CellTree:
    """A cell tree holds the particles of each world in order, and its cells level by level.

    Cell k of level l has the index ``first(l) + k`` in the columns of cells; level 0 are the leaves. Leaf k
    has the particles from position ``LEAF * k`` of the order on. order : the index of the particle at each
    position of the order. place : the coordinates of that particle, m. low, high : corners of the bounding
    box of each cell, m. levels : number of levels of a world.
    """

    def __init__(self, s: State) -> None:
        self.s = s
        sizes = [-(-s.capacity // LEAF)]
        while sizes[-1] > 1:
            sizes.append(-(-sizes[-1] // FAN))
        self.firsts = [sum(sizes[:level]) for level in range(len(sizes))]
        self.leaves, self.cells, self.most_levels = sizes[0], sum(sizes), len(sizes)
        self.place, self.low, self.high = (ti.Vector.field(3, s.real) for _ in range(3))
        self.low_corner, self.high_corner = ti.field(s.real), ti.field(s.real)
        self.population, self.levels = ti.field(ti.i32), ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.place)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.cells).place(self.low, self.high)
        for column in (self.low_corner, self.high_corner):
            builder.dense(ti.i, s.worlds).dense(ti.j, 3).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.most_levels).place(self.population)
        builder.dense(ti.i, s.worlds).place(self.levels)
        self.tree = Tree(builder)
        self.sort = RadixSort(s, PerParticle(s), 3 * CURVE_BITS)
        self.order = self.sort.order

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.sort.bytes()

    def phases(self) -> tuple[Item, ...]:
        """Return the items that sort the particles and store their positions in order; cells have no boxes
        yet."""
        sorting = (BeginTree(self), FindBox(self), MakeKeys(self), *self.sort.phases())
        return (*sorting, PutInPlace(self))

    @ti.func
    def first(self, level):
        """Return the index of the first cell of a level."""
        first = 0
        for k in ti.static(range(1, self.most_levels)):
            first = ti.select(level == k, self.firsts[k], first)
        return first

    @ti.func
    def leaf_end(self, w, k):
        """Return the position in the order after the last particle of leaf k."""
        return ti.min((k + 1) * LEAF, self.s.count[w])

    @ti.func
    def child_end(self, w, level, k):
        """Return the cell of the level below that follows the last one in cell k."""
        return ti.min((k + 1) * FAN, self.population[w, level - 1])

    @ti.func
    def next_cell(self, w, level, k):
        """Return level and number of the cell that follows in the order of the curve after all of cell k; at
        the end the level is above the last one."""
        up, number = level, k
        while up < self.levels[w] and (number % FAN == FAN - 1 or number == self.population[w, up] - 1):
            number //= FAN
            up += 1
        return up, number + 1


class OfTree(AtStage, PerParticle):
    """This phase is the base of phases that process each particle of a tree."""

    def __init__(self, tree: CellTree) -> None:
        super().__init__(tree.s)
        self.t = tree


class BeginTree(AtStage, Phase):
    """This phase computes the number of cells of each level."""

    def __init__(self, tree: CellTree) -> None:
        self.t, self.s = tree, tree.s

    @ti.func
    def run(self, w, _k):
        t = self.t
        t.sort.begin(w)
        for a in ti.static(range(3)):
            t.low_corner[w, a], t.high_corner[w, a] = ti.math.inf, -ti.math.inf
        number, level = (self.s.count[w] + LEAF - 1) // LEAF, 0
        t.population[w, 0] = number
        while number > 1:
            number = (number + FAN - 1) // FAN
            level += 1
            t.population[w, level] = number
        t.levels[w] = level + 1


class FindBox(AtStage, Phase):
    """This phase finds the box around all particles, by blocks of particles."""

    light = False

    def __init__(self, tree: CellTree) -> None:
        self.t, self.s, self.extent = tree, tree.s, -(-tree.s.capacity // BOX_BLOCK)

    @ti.func
    def size(self, w):
        return (self.s.count[w] + BOX_BLOCK - 1) // BOX_BLOCK

    @ti.func
    def run(self, w, b):
        t, s = self.t, self.s
        low, high = s.position[w, b * BOX_BLOCK], s.position[w, b * BOX_BLOCK]
        for i in range(b * BOX_BLOCK, ti.min((b + 1) * BOX_BLOCK, s.count[w])):
            low, high = ti.min(low, s.position[w, i]), ti.max(high, s.position[w, i])
        for a in ti.static(range(3)):
            ti.atomic_min(t.low_corner[w, a], low[a])
            ti.atomic_max(t.high_corner[w, a], high[a])


class MakeKeys(OfTree):
    """This phase computes the position of each particle along the curve, in a cube around all particles."""

    @ti.func
    def run(self, w, i):
        t, s, side = self.t, self.s, ti.cast(0.0, self.s.real)
        for a in ti.static(range(3)):
            side = ti.max(side, t.high_corner[w, a] - t.low_corner[w, a])
        cell = ti.Vector.zero(ti.i32, 3)
        for a in ti.static(range(3)):
            part = (s.position[w, i][a] - t.low_corner[w, a]) / ti.select(side > 0.0, side, 1.0)
            # In single precision values that are not finite must stay within range as well.
            cell[a] = ti.max(0, ti.min(ti.cast(part * (1 << CURVE_BITS), ti.i32), (1 << CURVE_BITS) - 1))
        t.sort.set_key(w, i, hilbert_index(cell))


class PutInPlace(OfTree):
    """This phase stores the positions in the order of the curve."""

    @ti.func
    def run(self, w, k):
        self.t.place[w, k] = self.s.position[w, self.t.order[w, k]]


def tree_memory(tree: CellTree, *columns: Any) -> Tree:
    """Return the memory of columns that have an entry for each cell."""
    builder = Builder()
    for column in columns:
        builder.dense(ti.i, tree.s.worlds).dense(ti.j, tree.cells).place(column)
    return Tree(builder)
