"""Moments of the mass in the cells of a tree: of leaves by their particles, of others by the cells within."""

from __future__ import annotations

from typing import Any

from scipy.constants import G

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.interactions.cell_tree import FAN, LEAF, CellTree, OfTree, tree_memory
from tisim.worlds.bound import Bound
from tisim.worlds.occasion import OnOccasion
from tisim.worlds.phases import Item, Phase, Repeat


@ti.data_oriented
class CellMoments:
    """Cell moments are mass, centre of mass and second moments about it of each cell, each mass times G.

    strength : G m of the particle in a place, m^3/s^2. total : G M of a cell. centre : r_c, m. diagonal,
    mixed : sum G m x x^T, with x = r - r_c, as (xx, yy, zz) and (yz, zx, xy), m^5/s^2. extent : how far from
    r_c a particle of the cell may be, m; the least of two bounds. opens_within : the square of the distance
    from r_c within which a cell is opened, (extent / theta)^2, m^2. level : the next one to be made.
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
        """Return the items that make the moments, after those of the tree."""
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
    """This phase puts G m of the particles in the order of the tree."""

    def __init__(self, tree: CellTree, moments: CellMoments) -> None:
        super().__init__(tree)
        self.moments = moments

    @ti.func
    def run(self, w, k):
        self.moments.strength[w, k] = G * self.s.mass[w, self.t.order[w, k]]


class LeafMoments(OnOccasion, Phase):
    """This phase makes box and moments of each leaf."""

    def __init__(self, moments: CellMoments) -> None:
        self.m, self.t, self.s = moments, moments.t, moments.s
        self.extent = self.t.leaves

    @ti.func
    def size(self, w):
        return self.t.population[w, 0]

    @ti.func
    def run(self, w, c):
        m, t = self.m, self.t
        if c == 0:
            m.level[w] = 1
        begin, end = c * LEAF, t.leaf_end(w, c)
        low, high, total = t.place[w, begin], t.place[w, begin], ti.cast(0.0, self.s.real)
        # About the first one: so it is exact where all are in one place.
        first, shift = t.place[w, begin], ti.Vector.zero(self.s.real, 3)
        for k in range(begin, end):
            low, high = ti.min(low, t.place[w, k]), ti.max(high, t.place[w, k])
            total += m.strength[w, k]
            shift += m.strength[w, k] * (t.place[w, k] - first)
        centre, square = first + shift / total, ti.cast(0.0, self.s.real)
        diagonal, mixed = ti.Vector.zero(self.s.real, 3), ti.Vector.zero(self.s.real, 3)
        for k in range(begin, end):
            x = t.place[w, k] - centre
            own, off = second_moments(x)
            diagonal += m.strength[w, k] * own
            mixed += m.strength[w, k] * off
            square = ti.max(square, x.norm_sqr())
        t.low[w, c], t.high[w, c] = low, high
        m.set(w, c, total, centre, diagonal, mixed, ti.sqrt(square))


class EachLevel(Repeat):
    """This item makes the moments of one level after the other."""

    def __init__(self, moments: CellMoments) -> None:
        super().__init__((LevelMoments(moments), EndLevel(moments)))
        self.m, self.usual = moments, moments.t.most_levels - 1

    @ti.func
    def pending(self, w):
        return self.m.t.levels[w] - self.m.level[w]


class LevelMoments(Phase):
    """This phase makes box and moments of each cell of a level, of the cells that it has of the one below."""

    def __init__(self, moments: CellMoments) -> None:
        self.m, self.t, self.s = moments, moments.t, moments.s
        self.extent = -(-self.t.leaves // FAN)

    @ti.func
    def size(self, w):
        return self.t.population[w, self.m.level[w]]

    @ti.func
    def run(self, w, k):
        m, t, level = self.m, self.t, self.m.level[w]
        below = t.first(level - 1)
        begin, end = below + k * FAN, below + t.child_end(w, level, k)
        low, high, total = t.low[w, begin], t.high[w, begin], ti.cast(0.0, self.s.real)
        first, shift = m.centre[w, begin], ti.Vector.zero(self.s.real, 3)
        for c in range(begin, end):
            low, high = ti.min(low, t.low[w, c]), ti.max(high, t.high[w, c])
            total += m.total[w, c]
            shift += m.total[w, c] * (m.centre[w, c] - first)
        centre, extent = first + shift / total, ti.cast(0.0, self.s.real)
        diagonal, mixed = ti.Vector.zero(self.s.real, 3), ti.Vector.zero(self.s.real, 3)
        for c in range(begin, end):
            x = m.centre[w, c] - centre
            own, off = second_moments(x)
            diagonal += m.diagonal[w, c] + m.total[w, c] * own
            mixed += m.mixed[w, c] + m.total[w, c] * off
            extent = ti.max(extent, x.norm() + m.extent[w, c])
        at = t.first(level) + k
        t.low[w, at], t.high[w, at] = low, high
        m.set(w, at, total, centre, diagonal, mixed, extent)


class EndLevel(Phase):
    """After this phase it is the turn of the next level."""

    def __init__(self, moments: CellMoments) -> None:
        self.m = moments

    @ti.func
    def run(self, w, _k):
        self.m.level[w] = self.m.level[w] + 1
