"""Rows of neighbours, as long as needed: what all lists of pairs have in common.

A particle lists those at least as large as itself, of which few find room around it, so rows are short
whatever the ratio of sizes. A row that is too short stops its world, and lists are made longer
(CompiledWorlds.grow_lists). What a pair does depends on its distance, never on whether the list was due:
results do not depend on when lists were made.

In the phases that make rows anew each pair is found once, and entered with its smaller particle. Within a
level of cells a particle looks at those that come after it in the order of cells. Of two levels the particles
of one search the other: those of the one that has less to search, so that a few large grains among many small
ones look for these, but many large ones are looked for.
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
from tisim.program.phases import Phase
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

ALL_PAIRS = 2**30
"""This is the ``listed_above`` of a world in which all pairs are listed, however far apart."""


@ti.data_oriented
class NeighbourRows:
    """Neighbour rows hold the listed pairs of every world: ``index[w, i, k]`` for k below ``size[w, i]``.

    sorted_position, sorted_radius, sorted_near : what a search reads of the particles, in the order of cells.
    searched : which levels the particles of each level search, a bit for each.
    row : room in a row. ordered : whether a row is in order of index. images : 1 where images that move past
    the box lie in other cells than the particles, and are looked for apart. stale : whether the rows of a
    world are to be made anew. longest : of the rows wanted last.
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
        """Return the room in which the longest row of those last made, which may have overflowed, has some to
        spare."""
        longest = int(self.longest.to_numpy().max())
        # Compiling for longer rows takes seconds: where particles come together, it is done once or twice.
        return max(-(-5 * longest // 4), 2 * self.row if longest > self.row else self.row)

    @in_taichi_thread
    def forget(self) -> None:
        """Have every list made anew before it is used again."""
        self.stale.fill(1)

    @ti.func
    def invalidate(self, w):
        """Have the list of a world made anew before it is used again."""
        self.stale[w] = 1

    @ti.func
    def reach(self, w, i):
        """Return how far (m) beyond the surface of a particle no larger i looks at most."""
        return ti.cast(0.0, self.s.real)

    @ti.func
    def lists(self, w, i, j):
        """Return whether the pair is i's to list; j is not i."""
        return 0

    @ti.func
    def leaves_out(self, w, i, j):
        """Return whether the pair is not listed, however near."""
        return False

    @ti.func
    def sees(self, d, distance, skin):
        """Return whether two that are d (m) apart may come within a distance (m) before the list is made
        anew, with this skin along each axis (m)."""
        return 0


def search_rows(rows: NeighbourRows) -> tuple[Phase, ...]:
    """Return the phases that make the rows anew; their particles have been sorted into cells."""
    return BeginRows(rows), CopySorted(rows), SearchRows(rows), EndRows(rows)


class BeginRows(OfGrid):
    """This phase chooses which levels the particles of each level search."""

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
        """Return how many rows of cells of a level are within ``reach`` (m)."""
        g, rows = self.g, ti.cast(1.0, self.s.real)
        for k in ti.static((1, 2)):
            cells = 2.0 * (reach + g.skin[w, k]) / g.cell[w, level, k] + 1.0
            rows *= ti.min(cells, ti.cast(g.dims[w, level, k], self.s.real))
        return rows


class CopySorted(OfParticles):
    """This phase copies what a search reads in the order of cells, in which it is read, and empties all
    rows."""

    def __init__(self, rows: NeighbourRows) -> None:
        super().__init__(rows.grid)
        self.n = rows

    @ti.func
    def run(self, w, m):
        n, s, i = self.n, self.s, self.g.order[w, m]
        n.sorted_position[w, m], n.sorted_radius[w, m] = s.position[w, i], s.radius[w, i]
        n.sorted_near[w, m], n.size[w, m] = self.g.near[w, i], 0


class SearchRows(OfBlocks):
    """This phase lets each particle look for those near it, in the order of cells: those that follow each
    other search the same ones."""

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
        """Enter the pairs of the m-th in order of cells with images of this ``turn``."""
        n, g, t = self.n, self.g, self.s.time[w]
        # Copies: the compiler cannot know that writing a row does not change what it reads.
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
                        # Around the whole box: each cell once.
                        first[k], last[k], whole = 0, dims[k] - 1, True
                for z in range(first[2], last[2] + 1):
                    for y in range(first[1], last[1] + 1):
                        line = self.inside(z, dims[2]) * dims[1] + self.inside(y, dims[1])
                        row = g.offset[w, level] + dims[0] * line
                        # Cells of a row follow each other in memory; across a joined face in two stretches.
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
                                    # Not as forces see it: the next step may take either through a face.
                                    d = g.domain.nearest(w, place, there, t)
                                smaller = ti.min(radius, n.sorted_radius[w, q])
                                seen = n.sees(d, smaller + ti.max(sight, n.sorted_near[w, q]), skin)
                                if ti.static(n.images > 0):
                                    seen = seen and g.domain.turn(w, place, there) == turn
                                if seen and not n.leaves_out(w, i, g.order[w, q]):
                                    self.enter(w, i, g.order[w, q])
                            x += end - begin + 1

    @ti.func
    def enter(self, w, i, j):
        """Enter a pair with the one that lists it."""
        n, mine = self.n, self.n.lists(w, i, j)
        lister, other = ti.select(mine, i, j), ti.select(mine, j, i)
        k = next_number(n.size, w, lister, ti.static(self.g.shared()))
        if k < n.row:
            n.index[w, lister, k] = other

    @ti.func
    def turns(self, c, cells):
        """Return which image of the box a cell lies in, along each axis: -1, 0 or 1."""
        return ti.select(c >= cells, 1, 0) - ti.select(c < 0, 1, 0)

    @ti.func
    def inside(self, c, cells):
        """Return the index of a cell that may lie across a joined face, by less than one turn."""
        return c + ti.select(c < 0, cells, 0) - ti.select(c >= cells, cells, 0)


class EndRows(OfBlocks):
    """This phase asks whether all pairs have found room, and puts rows in order where they are to be."""

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
                self.order(w, i, n.size[w, i])
        ti.atomic_add(n.total[w], total)
        if longest > n.longest[w]:
            ti.atomic_max(n.longest[w], longest)

    @ti.func
    def order(self, w, i, size):
        n = self.n
        for a in range(1, size):
            value, b = n.index[w, i, a], a - 1
            while b >= 0:
                if n.index[w, i, b] > value:
                    n.index[w, i, b + 1] = n.index[w, i, b]
                    b -= 1
                else:
                    break
            n.index[w, i, b + 1] = value
