"""Neighbour rows, the common part of all pair lists.

A particle lists neighbours of at least its own size. Few of these fit around it, so rows are short for any
size ratio. If a row overflows, its world stops and the lists are lengthened (CompiledWorlds.grow_lists).
Interactions depend on the distance of a pair only, so results do not depend on when lists were made.

A rebuild finds each pair once and enters it in the row of the smaller particle. Within a level of cells a
particle searches only the particles after it in cell order. Between two levels, the particles of the level
with less work search the other one. A few large grains among many small ones therefore search for the small
ones, while many large grains are searched for.
"""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.domains.domain import Domain
from tisim.numerics.ieee import far_away
from tisim.pairs.cell_grid import LEVELS, CellGrid, OfBlocks, OfGrid, OfParticles, next_number
from tisim.pairs.cell_phases import sort_row
from tisim.program.phases import Phase
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

ALL_PAIRS = 2**30
"""Value of ``listed_above`` for a world in which all pairs are listed at any distance."""


@ti.data_oriented
class NeighbourRows:
    """Neighbour rows hold the listed pairs of every world: ``index[w, i, k]`` for k below ``size[w, i]``.

    sorted_position, sorted_radius, sorted_near : copies of the particles in cell order, read by a search.
    searched : bit mask of the levels that the particles of each level search.
    row : capacity of a row. ordered : whether rows are sorted by index.
    images : 1 if periodic images move past the box and thus lie in other cells, so that they are searched
    separately; else 0.
    stale : whether the rows of a world must be rebuilt. longest : length required by the longest row of the
    last rebuild.
    """

    ordered: ClassVar[bool] = False

    def __init__(self, s: State, domain: Bound[Domain], row: int) -> None:
        self.s, self.domain, self.row = s, domain, row
        self.images = 1 if domain.shears() else 0
        self.grid = CellGrid(s, domain)
        self.index, self.size, self.stale, self.longest = (ti.field(ti.i32) for _ in range(4))
        self.since, self.total = ti.field(ti.f64), ti.field(ti.i64)
        self.sorted_position = ti.Vector.field(3, s.real)
        self.sorted_radius, self.sorted_near = ti.field(s.real), ti.field(s.real)
        self.searched = ti.field(ti.i32)
        builder = Builder()
        place = (self.sorted_position.get_scalar_field(k) for k in range(3))
        for columns in ((self.size,), (*place, self.sorted_radius, self.sorted_near)):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(*columns)
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).dense(ti.k, row).place(self.index)
        for column in (self.stale, self.longest, self.total):
            builder.dense(ti.i, s.worlds).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, 3).place(self.since)
        builder.dense(ti.i, s.worlds).dense(ti.j, LEVELS).place(self.searched)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.grid.bytes()

    @in_taichi_thread
    def wanted_row(self) -> int:
        """Return a row capacity with spare room for the longest row as last made, which may have
        overflowed."""
        longest = int(self.longest.to_numpy().max())
        # Compiling for longer rows takes seconds; doubling them limits this to once or twice.
        return max(-(-5 * longest // 4), 2 * self.row if longest > self.row else self.row)

    @in_taichi_thread
    def forget(self) -> None:
        """Have every list rebuilt before its next use."""
        self.stale.fill(1)

    @ti.func
    def invalidate(self, w):
        """Have the list of a world rebuilt before its next use."""
        self.stale[w] = 1

    @ti.func
    def reach(self, w, i):
        """Return the largest range (m) of i beyond the surface of a particle of equal or smaller size."""
        return ti.cast(0.0, self.s.real)

    @ti.func
    def lists(self, w, i, j):
        """Return whether the pair is listed by i; j is not i."""
        return 0

    @ti.func
    def leaves_out(self, w, i, j, d, skin):
        """Return whether the pair at separation d (m) is excluded from the list although bounding spheres
        are near, given the skin along each axis (m)."""
        return False

    @ti.func
    def sees(self, d, distance, skin):
        """Return whether two particles at separation d (m) may come within a distance (m) before the next
        rebuild.

        skin : neighbour-list skin along each axis (m).
        """
        return 0


def search_rows(rows: NeighbourRows) -> tuple[Phase, ...]:
    """Return the phases that rebuild the rows; particles must be sorted into cells already."""
    return BeginRows(rows), CopySorted(rows), SearchRows(rows), EndRows(rows)


class BeginRows(OfGrid):
    """This phase chooses the levels that the particles of each level search."""

    def __init__(self, rows: NeighbourRows) -> None:
        super().__init__(rows.grid)
        self.n = rows

    @ti.func
    def run(self, w, _k):
        n, g = self.n, self.g
        n.longest[w], n.total[w] = 0, 0
        for low in range(LEVELS):
            n.searched[w, low] = 1 << low
        for low in range(LEVELS):
            if g.population[w, low] > 0:
                for high in range(low + 1, LEVELS):
                    if g.population[w, high] > 0:
                        reach = g.largest[w, low] + g.widest[w, high]
                        up = g.population[w, low] * self.work(w, high, reach)
                        if g.population[w, high] * self.work(w, low, reach) < up:
                            n.searched[w, high] = n.searched[w, high] + (1 << low)
                        else:
                            n.searched[w, low] = n.searched[w, low] + (1 << high)

    @ti.func
    def work(self, w, level, reach):
        """Return the number of rows of cells of a level within ``reach`` (m)."""
        g, rows = self.g, ti.cast(1.0, self.s.real)
        for k in ti.static((1, 2)):
            cells = 2.0 * (reach + g.skin[w, k]) / g.cell[w, level, k] + 1.0
            rows *= ti.min(cells, ti.cast(g.dims[w, level, k], self.s.real))
        return rows


class CopySorted(OfParticles):
    """This phase copies the particle data of the search into cell order, and empties all rows."""

    def __init__(self, rows: NeighbourRows) -> None:
        super().__init__(rows.grid)
        self.n = rows

    @ti.func
    def run(self, w, m):
        n, s, i = self.n, self.s, self.g.order[w, m]
        n.sorted_position[w, m], n.sorted_radius[w, m] = s.position[w, i], s.radius[w, i]
        n.sorted_near[w, m], n.size[w, m] = self.g.near[w, i], 0


class SearchRows(OfBlocks):
    """This phase searches the neighbours of each particle, in cell order, because consecutive particles
    search the same cells."""

    def __init__(self, rows: NeighbourRows) -> None:
        super().__init__(rows.grid)
        self.n = rows

    @ti.func
    def run(self, w, b):
        n = self.n
        for m in range(self.begin(b), self.end(w, b)):
            for turn in range(-n.images, n.images + 1):
                self.search(w, m, turn)

    @ti.func
    def search(self, w, m, turn):
        """Enter the pairs of the m-th particle in cell order with images of this ``turn``."""
        n, g, t = self.n, self.g, self.s.time[w]
        # Local copies: the compiler cannot know that writing a row does not change these values.
        i, place, side = g.order[w, m], n.sorted_position[w, m], g.domain.side(w)
        radius, near, skin = n.sorted_radius[w, m], n.sorted_near[w, m], g.skin_along(w)
        r, every = g.domain.seen_from(w, place, turn, t), self.s.listed_above[w] >= ALL_PAIRS
        sight, own = ti.select(every, ti.static(far_away()), near), g.level(w, radius)
        searched = n.searched[w, own]
        for level in range(LEVELS):
            if (searched >> level) % 2 > 0:
                dims, begun, reach = g.dims_of(w, level), 0, radius + g.widest[w, level]
                if level == own:
                    begun = m + 1
                elif level < own:
                    reach = near + g.largest[w, level]
                first = g.floor_of(w, level, r - reach - skin)
                last, whole = g.floor_of(w, level, r + reach + skin), every
                for k in ti.static(range(3)):
                    if ti.static(not g.joined[k]):
                        first[k], last[k] = ti.max(first[k], 0), ti.min(last[k], dims[k] - 1)
                    if last[k] - first[k] >= dims[k] or every:
                        # The range covers the whole box, so each cell is visited once.
                        first[k], last[k], whole = 0, dims[k] - 1, True
                for z in range(first[2], last[2] + 1):
                    for y in range(first[1], last[1] + 1):
                        line = self.inside(z, dims[2]) * dims[1] + self.inside(y, dims[1])
                        row = g.offset[w, level] + dims[0] * line
                        # Cells of a row are contiguous in memory; across a joined face they form two
                        # stretches.
                        x = first[0]
                        while x <= last[0]:
                            begin = self.inside(x, dims[0])
                            end = ti.min(begin + last[0] - x, dims[0] - 1)
                            here = r - self.turns(ti.Vector([x, y, z]), dims) * side
                            a = ti.max(g.cell_start[w, row + begin], begun)
                            for q in range(a, g.cell_start[w, row + end + 1]):
                                there = n.sorted_position[w, q]
                                d = there - here
                                if ti.static(n.images > 0) or whole:
                                    # Not the separation used by forces, as the next step may take either
                                    # particle through a face.
                                    d = g.domain.nearest(w, place, there, t)
                                smaller = ti.min(radius, n.sorted_radius[w, q])
                                seen = n.sees(d, smaller + ti.max(sight, n.sorted_near[w, q]), skin)
                                if ti.static(n.images > 0):
                                    seen = seen and g.domain.turn(w, place, there) == turn
                                if seen and not n.leaves_out(w, i, g.order[w, q], d, skin):
                                    self.enter(w, i, g.order[w, q])
                            x += end - begin + 1

    @ti.func
    def enter(self, w, i, j):
        """Enter a pair in the row of the particle that lists it."""
        n, mine = self.n, self.n.lists(w, i, j)
        lister, other = ti.select(mine, i, j), ti.select(mine, j, i)
        k = next_number(n.size, w, lister, ti.static(self.g.shared()))
        if k < n.row:
            n.index[w, lister, k] = other

    @ti.func
    def turns(self, c, cells):
        """Return the image of the box that a cell lies in, along each axis: -1, 0 or 1."""
        return ti.select(c >= cells, 1, 0) - ti.select(c < 0, 1, 0)

    @ti.func
    def inside(self, c, cells):
        """Return the index of a cell that may lie less than one box length across a joined face."""
        return c + ti.select(c < 0, cells, 0) - ti.select(c >= cells, cells, 0)


class EndRows(OfBlocks):
    """This phase checks whether all pairs fit, and sorts the rows that must be ordered."""

    def __init__(self, rows: NeighbourRows) -> None:
        super().__init__(rows.grid)
        self.n = rows

    @ti.func
    def run(self, w, b):
        n, total, longest = self.n, ti.i64(0), 0
        for i in range(self.begin(b), self.end(w, b)):
            count = n.size[w, i]
            total += count
            longest = ti.max(longest, count)
            if count > n.row:
                self.s.fail(w, WorldStatus.LIST_OVERFLOW, i)
                n.size[w, i] = n.row
            if ti.static(n.ordered):
                sort_row(n.index, ti.Vector([w, i]), 0, n.size[w, i])
        ti.atomic_add(n.total[w], total)
        if longest > n.longest[w]:
            ti.atomic_max(n.longest[w], longest)
