"""Phases that sort particles into cells, in parallel and deterministically.

Counts are integer sums, and each cell is finally sorted by index. The order therefore depends neither on the
threads nor on the previous order.
"""

from typing import Any

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.pairs.cell_grid import (
    CELLS_PER_PARTICLE,
    LEVELS,
    SPARE_CELLS,
    CellGrid,
    OfBlocks,
    OfCells,
    OfGrid,
    OfParticles,
    next_number,
)
from tisim.program.phases import Phase
from tisim.state.status import WorldStatus


def measure_phases(grid: CellGrid, seer: Any) -> tuple[Phase, ...]:
    """Return the phases that measure the particles; ``seer.reach(w, i)`` is the interaction range of i beyond
    the surface of another particle (m)."""
    return ResetGrid(grid), FindExtent(grid), MeasureLevels(grid, seer)


def cell_phases(grid: CellGrid) -> tuple[Phase, ...]:
    """Return the phases that sort the particles into cells; ``skin`` must be set."""
    count = (ShapeGrid(grid), ClearCells(grid), CountInCells(grid))
    return (*count, *grid.starts.phases(), PlaceInCells(grid), SortCells(grid))


class ResetGrid(OfGrid):
    """This phase resets the measured extents of the particles."""

    @ti.func
    def run(self, w, _k):
        g = self.g
        g.smallest[w] = ti.math.inf
        for k in ti.static(range(3)):
            g.low[w, k], g.high[w, k] = ti.math.inf, -ti.math.inf
        for level in range(LEVELS):
            g.widest[w, level], g.largest[w, level], g.population[w, level] = 0.0, 0.0, 0


class FindExtent(OfBlocks):
    """This phase finds the smallest radius and the bounding box of the particles."""

    @ti.func
    def run(self, w, b):
        g, s, first = self.g, self.s, self.begin(b)
        low, high, smallest = s.position[w, first], s.position[w, first], s.radius[w, first]
        for i in range(first, self.end(w, b)):
            r, radius = s.position[w, i], s.radius[w, i]
            # A particle that is not finite has no cell.
            if not finite(ti.abs(r).sum() + radius):
                s.fail(w, WorldStatus.NOT_FINITE, i)
            low, high, smallest = ti.min(low, r), ti.max(high, r), ti.min(smallest, radius)
        if smallest < g.smallest[w]:
            ti.atomic_min(g.smallest[w], smallest)
        for k in ti.static(range(3)):
            if low[k] < g.low[w, k]:
                ti.atomic_min(g.low[w, k], low[k])
            if high[k] > g.high[w, k]:
                ti.atomic_max(g.high[w, k], high[k])


class MeasureLevels(OfBlocks):
    """This phase finds the number of particles, the largest radius and the widest search range of each
    level."""

    def __init__(self, grid: CellGrid, seer: Any) -> None:
        super().__init__(grid)
        self.seer = seer

    @ti.func
    def run(self, w, b):
        g, s, population = self.g, self.s, 0
        none = ti.cast(0.0, s.real)
        largest, widest = none, none
        # Consecutive particles of one level are recorded together.
        current = g.level(w, s.radius[w, self.begin(b)])
        for i in range(self.begin(b), self.end(w, b)):
            radius = s.radius[w, i]
            near, level = radius + self.seer.reach(w, i), g.level(w, radius)
            g.near[w, i] = near
            if level != current:
                self.note(w, current, population, largest, widest)
                current, population, largest, widest = level, 0, none, none
            population += 1
            largest, widest = ti.max(largest, radius), ti.max(widest, near)
        self.note(w, current, population, largest, widest)

    @ti.func
    def note(self, w, level, population, largest, widest):
        g = self.g
        ti.atomic_add(g.population[w, level], population)
        if largest > g.largest[w, level]:
            ti.atomic_max(g.largest[w, level], largest)
        if widest > g.widest[w, level]:
            ti.atomic_max(g.widest[w, level], widest)


class ShapeGrid(OfGrid):
    """This phase sets the cells of each level: as wide as the search range of two of its particles, and
    limited in number."""

    @ti.func
    def run(self, w, _k):
        g = self.g
        low, extent, cells = g.domain.origin(w), g.extent(w), 0
        for k in ti.static(range(3)):
            if ti.static(g.joined[k]):
                g.low[w, k], g.high[w, k] = low[k], low[k] + extent[k]
        for level in range(LEVELS):
            if g.population[w, level] > 0:
                most = CELLS_PER_PARTICLE * g.population[w, level] + SPARE_CELLS
                width = g.largest[w, level] + g.widest[w, level] + g.skin_along(w)
                dims = g.divide(ti.min(extent / width, 1e3), most)
                g.offset[w, level] = cells
                for k in ti.static(range(3)):
                    g.dims[w, level, k] = dims[k]
                    g.cell[w, level, k] = ti.max(extent[k] / dims[k], width[k] * 1e-3)
                cells += dims[0] * dims[1] * dims[2]
        g.total[w] = cells


class ClearCells(OfCells):
    """This phase empties every cell."""

    @ti.func
    def run(self, w, c):
        self.g.cell_start[w, c] = 0


class CountInCells(OfParticles):
    """This phase finds the cell of each particle and counts the particles of each cell, in any order of
    threads."""

    @ti.func
    def run(self, w, i):
        g, s = self.g, self.s
        level = g.level(w, s.radius[w, i])
        c = g.cell_index(w, level, g.place(w, level, s.position[w, i]))
        g.cell_of[w, i] = c
        # Counts are shifted by one cell, so that the prefix sum at a cell is its first place.
        g.rank[w, i] = next_number(g.cell_start, w, c + 1, ti.static(self.g.shared()))


class PlaceInCells(OfParticles):
    """This phase enters each particle in its cell, in the order in which the particles were counted."""

    @ti.func
    def run(self, w, i):
        g = self.g
        g.order[w, g.cell_start[w, g.cell_of[w, i]] + g.rank[w, i]] = i


class SortCells(OfCells):
    """This phase sorts each cell by particle index."""

    @ti.func
    def size(self, w):
        return self.g.total[w]

    @ti.func
    def run(self, w, c):
        g = self.g
        sort_row(g.order, ti.Vector([w]), g.cell_start[w, c], g.cell_start[w, c + 1])


@ti.func
def sort_row(column: ti.template(), row, begin, end):  # type: ignore[valid-type]
    """Sort column[row, begin:end], a few integers, by insertion; ``row`` : vector of the other indices."""
    for a in range(begin + 1, end):
        value, b = column[row, a], a - 1
        while b >= begin:
            if column[row, b] > value:
                column[row, b + 1] = column[row, b]
                b -= 1
            else:
                break
        column[row, b + 1] = value
