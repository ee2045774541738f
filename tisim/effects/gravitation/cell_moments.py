"""Mass moments of the cells of a tree: leaves from their particles, other cells from the cells within
them."""

from __future__ import annotations

from typing import Any

from scipy.constants import G

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.effects.gravitation.cell_tree import FAN, LEAF, CellTree, OfTree, tree_memory
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import Item, Phase, Repeat
from tisim.state.bound import Bound


@ti.data_oriented
class CellMoments:
    """Cell moments are total mass, centre of mass and second moments about it of each cell, each mass times
    G.

    strength : G m of the particle at each position in the order, m^3/s^2. total : G M of a cell. centre :
    r_c, m. diagonal, mixed : sum G m x x^T, with x = r - r_c, as (xx, yy, zz) and (yz, zx, xy), m^5/s^2.
    extent : largest distance from r_c of a particle of the cell, the smaller of two upper bounds, m.
    opens_within : the square of the distance from r_c within which a cell is opened, (extent / theta)^2, m^2.
    level : the next level to be computed.
    """

    def __init__(self, tree: CellTree, effect: Bound[Any]) -> None:
        self.t, self.s, self.effect = tree, tree.s, effect
        real = tree.s.real
        self.strength, self.total, self.extent, self.opens_within = (ti.field(real) for _ in range(4))
        self.centre, self.diagonal, self.mixed = (ti.Vector.field(3, real) for _ in range(3))
        self.level = ti.field(ti.i32)
        cells = (self.total, self.centre, self.diagonal, self.mixed, self.extent, self.opens_within)
        builder = Builder()
        builder.dense(ti.i, tree.s.worlds).dense(ti.j, tree.s.capacity).place(self.strength)
        builder.dense(ti.i, tree.s.worlds).place(self.level)
        self.trees = (tree_memory(tree, *cells), Tree(builder))

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return sum(tree.bytes for tree in self.trees)

    def phases(self) -> tuple[Item, ...]:
        """Return the items that compute the moments, after the items of the tree."""
        return PutStrengths(self.t, self), LeafMoments(self), EachLevel(self)

    @ti.func
    def set(self, w, c, total, centre, diagonal, mixed, extent):
        """Set the moments of a cell whose box is known."""
        corner = ti.max(self.t.high[w, c] - centre, centre - self.t.low[w, c])
        reach = ti.min(extent, corner.norm())
        self.total[w, c], self.centre[w, c] = total, centre
        self.diagonal[w, c], self.mixed[w, c] = diagonal, mixed
        self.extent[w, c] = reach
        self.opens_within[w, c] = (reach / self.effect.opening_angle(w)) ** 2


@ti.func
def second_moments(x):
    """Return (xx, yy, zz) and (yz, zx, xy)."""
    return x * x, x.yzx * x.zxy


class PutStrengths(OfTree):
    """This phase stores G m of the particles in the order of the tree."""

    def __init__(self, tree: CellTree, moments: CellMoments) -> None:
        super().__init__(tree)
        self.moments = moments

    @ti.func
    def run(self, w, k):
        self.moments.strength[w, k] = G * self.s.mass[w, self.t.order[w, k]]


class Gather(Phase):
    """This phase computes box and moments of cells from their members, which have a box, a centre, G m,
    second moments about the centre, and an extent around it."""

    def __init__(self, moments: CellMoments, extent: int) -> None:
        self.m, self.t, self.s, self.extent = moments, moments.t, moments.s, extent

    @ti.func
    def box(self, w, c):
        """Return the low and the high corner of member c, m."""
        return self.t.low[w, c], self.t.high[w, c]

    @ti.func
    def middle(self, w, c):
        """Return the centre (m) and the total (m^3/s^2) of member c."""
        return self.m.centre[w, c], self.m.total[w, c]

    @ti.func
    def spread(self, w, c):
        """Return the second moments (m^5/s^2) and the extent (m) of member c about its centre."""
        return self.m.diagonal[w, c], self.m.mixed[w, c], self.m.extent[w, c]

    @ti.func
    def gather(self, w, cell, begin, end):
        """Set box and moments of a cell from its members, ``begin`` to ``end``."""
        low, high = self.box(w, begin)
        # Relative to the first member, so that the result is exact if all are in one place.
        first, _part = self.middle(w, begin)
        shift, total = ti.Vector.zero(self.s.real, 3), ti.cast(0.0, self.s.real)
        for c in range(begin, end):
            lowest, highest = self.box(w, c)
            centre, part = self.middle(w, c)
            low, high = ti.min(low, lowest), ti.max(high, highest)
            total += part
            shift += part * (centre - first)
        about, extent = first + shift / total, ti.cast(0.0, self.s.real)
        diagonal, mixed = ti.Vector.zero(self.s.real, 3), ti.Vector.zero(self.s.real, 3)
        for c in range(begin, end):
            centre, part = self.middle(w, c)
            along, across, far = self.spread(w, c)
            x = centre - about
            own, off = second_moments(x)
            diagonal += along + part * own
            mixed += across + part * off
            extent = ti.max(extent, x.norm() + far)
        self.t.low[w, cell], self.t.high[w, cell] = low, high
        self.m.set(w, cell, total, about, diagonal, mixed, extent)


class LeafMoments(AtStage, Gather):
    """This phase computes box and moments of each leaf from its particles."""

    def __init__(self, moments: CellMoments) -> None:
        super().__init__(moments, moments.t.leaves)

    @ti.func
    def box(self, w, c):
        return self.t.place[w, c], self.t.place[w, c]

    @ti.func
    def middle(self, w, c):
        return self.t.place[w, c], self.m.strength[w, c]

    @ti.func
    def spread(self, w, c):
        none = ti.Vector.zero(self.s.real, 3)
        return none, none, ti.cast(0.0, self.s.real)

    @ti.func
    def size(self, w):
        return self.t.population[w, 0]

    @ti.func
    def run(self, w, c):
        if c == 0:
            self.m.level[w] = 1
        self.gather(w, c, c * LEAF, self.t.leaf_end(w, c))


class EachLevel(Repeat):
    """This item computes the moments level by level."""

    def __init__(self, moments: CellMoments) -> None:
        super().__init__((LevelMoments(moments), EndLevel(moments)))
        self.m, self.usual = moments, moments.t.most_levels - 1

    @ti.func
    def pending(self, w):
        return self.m.t.levels[w] - self.m.level[w]


class LevelMoments(Gather):
    """This phase computes box and moments of each cell of a level from its cells of the level below."""

    def __init__(self, moments: CellMoments) -> None:
        super().__init__(moments, -(-moments.t.leaves // FAN))

    @ti.func
    def size(self, w):
        return self.t.population[w, self.m.level[w]]

    @ti.func
    def run(self, w, k):
        t, level = self.t, self.m.level[w]
        below = t.first(level - 1)
        self.gather(w, t.first(level) + k, below + k * FAN, below + t.child_end(w, level, k))


class EndLevel(Phase):
    """This phase advances to the next level."""

    def __init__(self, moments: CellMoments) -> None:
        self.m = moments

    @ti.func
    def run(self, w, _k):
        self.m.level[w] = self.m.level[w] + 1
