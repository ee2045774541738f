"""Particles sorted into cells, with a level of cells for each class of sizes: in parallel, deterministic.

A level holds the radii from one power of two times the smallest to the next, and its cells are as wide as two
of its particles see each other. So what is searched around a particle follows the particles there, whatever
the ratio of sizes. Counts are integer sums, and each cell is sorted by index in the end: the order depends
neither on the threads nor on what was there before.
"""

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.components.domain import Domain
from tisim.numerics.ieee import finite
from tisim.worlds.bound import Bound
from tisim.worlds.phases import Phase
from tisim.worlds.prefix_sum import PrefixSum
from tisim.worlds.state import State
from tisim.worlds.status import WorldStatus

LEVELS = 8
"""There are this many levels of cells: radii in a ratio of more than 2^7 share the last."""
CELLS_PER_PARTICLE, SPARE_CELLS = 2, 8
"""A level of n particles has at most this many cells for each, and so many besides."""


@ti.data_oriented
class CellGrid:
    """A cell grid holds the cells of every world.

    near : radius of each particle and how far it looks beyond the surface of another, m. skin : m.
    """

    def __init__(self, s: State, domain: Bound[Domain]) -> None:
        self.s, self.domain, self.joined = s, domain, domain.cyclic()
        self.max_cells = CELLS_PER_PARTICLE * s.capacity + SPARE_CELLS * LEVELS
        builder = Builder()
        self.near, self.skin, self.smallest = (ti.field(s.real) for _ in range(3))
        self.low, self.high, self.cell, self.widest, self.largest = (ti.field(s.real) for _ in range(5))
        self.cell_start, self.cell_of, self.order = (ti.field(ti.i32) for _ in range(3))
        self.population, self.offset, self.dims, self.total = (ti.field(ti.i32) for _ in range(4))
        particles = builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity)
        for column in (self.near, self.cell_of, self.order):
            particles.place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.max_cells + 1).place(self.cell_start)
        for column in (self.skin, self.smallest, self.total):
            builder.dense(ti.i, s.worlds).place(column)
        for column in (self.low, self.high):
            builder.dense(ti.i, s.worlds).dense(ti.j, 3).place(column)
        levels = builder.dense(ti.i, s.worlds).dense(ti.j, LEVELS)
        for column in (self.widest, self.largest, self.population, self.offset):
            levels.place(column)
        for column in (self.dims, self.cell):
            levels.dense(ti.k, 3).place(column)
        self.tree = Tree(builder)
        # Where each cell ends among all: sums over the cells before it.
        self.ends = PrefixSum(s, OfCells(self), self.cell_start, self.cell_start)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.ends.bytes()

    @ti.func
    def level(self, w, radius):
        """Return the level of a particle of this radius."""
        size, level = radius, 0
        while size >= 2.0 * self.smallest[w] and level < LEVELS - 1:
            size *= 0.5
            level += 1
        return level

    @ti.func
    def place(self, w, level, r):
        """Return the index of the cell of a level along each axis."""
        at = ti.Vector.zero(ti.i32, 3)
        for k in ti.static(range(3)):
            c = ti.floor((r[k] - self.low[w, k]) / self.cell[w, level, k], ti.i32)
            at[k] = ti.max(0, ti.min(c, self.dims[w, level, k] - 1))
        return at

    @ti.func
    def row(self, w, level, z, y):
        """Return the index of the first cell of a row along x."""
        return self.offset[w, level] + (z * self.dims[w, level, 1] + y) * self.dims[w, level, 0]

    @ti.func
    def cell_index(self, w, level, at):
        """Return the index of a cell, by its index along each axis."""
        return self.row(w, level, at[2], at[1]) + at[0]


class OfGrid(Phase):
    """This phase works on the cells of a world."""

    def __init__(self, grid: CellGrid) -> None:
        self.g, self.s = grid, grid.s


class OfParticles(OfGrid):
    """This phase works on each particle."""

    def __init__(self, grid: CellGrid) -> None:
        super().__init__(grid)
        self.extent = grid.s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class OfCells(OfGrid):
    """This phase works on each cell."""

    def __init__(self, grid: CellGrid) -> None:
        super().__init__(grid)
        self.extent = grid.max_cells + 1

    @ti.func
    def size(self, w):
        return self.g.total[w] + 1


class ResetGrid(OfGrid):
    """This phase forgets what is known of the particles."""

    @ti.func
    def run(self, w, _k):
        g = self.g
        g.smallest[w] = ti.math.inf
        for k in ti.static(range(3)):
            g.low[w, k], g.high[w, k] = ti.math.inf, -ti.math.inf
        for level in range(LEVELS):
            g.widest[w, level], g.largest[w, level], g.population[w, level] = 0.0, 0.0, 0


class FindExtent(OfParticles):
    """This phase finds the smallest radius, and the corners of the box around all."""

    @ti.func
    def run(self, w, i):
        g, s = self.g, self.s
        r, radius = s.position[w, i], s.radius[w, i]
        # What is not finite belongs to no cell.
        if not finite(ti.abs(r).sum() + radius):
            s.fail(w, WorldStatus.NOT_FINITE, i)
        if radius < g.smallest[w]:
            ti.atomic_min(g.smallest[w], radius)
        for k in ti.static(range(3)):
            if r[k] < g.low[w, k]:
                ti.atomic_min(g.low[w, k], r[k])
            if r[k] > g.high[w, k]:
                ti.atomic_max(g.high[w, k], r[k])


class MeasureLevels(OfParticles):
    """This phase finds how many particles each level has, their largest radius, and how far they are seen at
    most."""

    @ti.func
    def run(self, w, i):
        g, s = self.g, self.s
        radius, near = s.radius[w, i], g.near[w, i]
        level = g.level(w, radius)
        ti.atomic_add(g.population[w, level], 1)
        if radius > g.largest[w, level]:
            ti.atomic_max(g.largest[w, level], radius)
        if near > g.widest[w, level]:
            ti.atomic_max(g.widest[w, level], near)


class ShapeGrid(OfGrid):
    """This phase gives each level cells, as wide as two of its particles see each other and not too many."""

    @ti.func
    def run(self, w, _k):
        g = self.g
        extent, cells = ti.Vector.zero(self.s.real, 3), 0
        low, side = g.domain.origin(w), g.domain.side(w)
        for k in ti.static(range(3)):
            if ti.static(g.joined[k]):
                g.low[w, k], g.high[w, k] = low[k], low[k] + side[k]
                extent[k] = side[k]
            else:
                extent[k] = g.high[w, k] - g.low[w, k]
        for level in range(LEVELS):
            most = CELLS_PER_PARTICLE * g.population[w, level] + SPARE_CELLS
            width = g.largest[w, level] + g.widest[w, level] + g.skin[w]
            dims = ti.max(1, ti.floor(ti.min(extent / width, 1e3), ti.i32))
            while dims[0] * dims[1] * dims[2] > most:
                dims = (dims + 1) // 2
            g.offset[w, level] = cells
            for k in ti.static(range(3)):
                g.dims[w, level, k] = dims[k]
                g.cell[w, level, k] = ti.max(extent[k] / dims[k], width * 1e-3)
            if g.population[w, level] > 0:
                cells += dims[0] * dims[1] * dims[2]
        g.total[w] = cells


class ClearCells(OfCells):
    """This phase empties every cell."""

    @ti.func
    def run(self, w, c):
        self.g.cell_start[w, c] = 0


class CountInCells(OfParticles):
    """This phase finds the cell of each particle, and how many each cell has."""

    @ti.func
    def run(self, w, i):
        g, s = self.g, self.s
        level = g.level(w, s.radius[w, i])
        c = g.cell_index(w, level, g.place(w, level, s.position[w, i]))
        g.cell_of[w, i] = c
        ti.atomic_add(g.cell_start[w, c], 1)


class PlaceInCells(OfParticles):
    """This phase enters each particle, from the end of its cell on, in whatever order threads come."""

    @ti.func
    def run(self, w, i):
        g = self.g
        g.order[w, ti.atomic_sub(g.cell_start[w, g.cell_of[w, i]], 1) - 1] = i


class SortCells(OfCells):
    """This phase orders each cell by index."""

    @ti.func
    def size(self, w):
        return self.g.total[w]

    @ti.func
    def run(self, w, c):
        g = self.g
        sort_row(g.order, w, g.cell_start[w, c], g.cell_start[w, c + 1])


@ti.func
def sort_row(column: ti.template(), w, begin, end):  # type: ignore[valid-type]
    """Sort column[w, begin:end], a few integers, by insertion."""
    for a in range(begin + 1, end):
        value, b = column[w, a], a - 1
        while b >= begin:
            if column[w, b] > value:
                column[w, b + 1] = column[w, b]
                b -= 1
            else:
                break
        column[w, b + 1] = value


def measure_phases(grid: CellGrid) -> tuple[Phase, ...]:
    """Return the phases that measure the particles; ``near`` must be set."""
    return tuple(kind(grid) for kind in (ResetGrid, FindExtent, MeasureLevels))


def cell_phases(grid: CellGrid) -> tuple[Phase, ...]:
    """Return the phases that sort the particles into cells; ``skin`` must be set."""
    count = (ShapeGrid(grid), ClearCells(grid), CountInCells(grid))
    return (*count, *grid.ends.phases(), PlaceInCells(grid), SortCells(grid))
