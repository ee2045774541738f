"""Pairs that short-ranged forces may act between, each listed once, by its smaller particle.

A particle lists those at least as large as itself (of equals, those of higher id), of which few find room
around it, so rows are short whatever the ratio of sizes. A list is made anew when particles have moved so far
that a pair it lacks could matter; the skin says how far that is. What a pair does depends on its distance,
never on whether the list was due: results do not depend on when lists were made.
"""

from dataclasses import dataclass

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.domain import Domain
from tisim.effects.base import Pairwise
from tisim.neighbours.cell_grid import LEVELS, CellGrid, OfGrid, OfParticles, cell_phases, measure_phases
from tisim.numerics.ieee import far_away
from tisim.worlds.bound import Bound
from tisim.worlds.program import Phase
from tisim.worlds.state import State
from tisim.worlds.status import WorldStatus

REBUILD_COST = 100.0
"""Making a list takes, for each particle, as long as this many listed pairs take in a step that do not act on
each other. Measured in a bed of grains (docs/performance.md): some 900 ns beside 9."""
ALL_PAIRS = 2**30
"""This is the ``listed_above`` of a world in which all pairs are listed, however far apart."""
LEAST_SKIN, MOST_SKIN = 0.01, 0.5
"""These bound the skin, in distances at which two of the smallest particles see each other."""
FEWEST_PAIRS = 1.0
"""So many pairs of each particle are taken to see each other, where there are fewer: they may come to."""
REACH_PART = 0.125
"""Part of the skin that is kept for laws that come to reach farther, as that of particles that grow does."""


@dataclass(frozen=True)
class ListSizes:
    """The list sizes say how much a list of pairs has room for: the pairs that a particle lists, and those of
    each particle of a world in the mean.

    Spheres that only touch, of any sizes, touch fewer than 14.93 others in the mean, and make half as many
    pairs (G. Kuperberg and O. Schramm, Math. Res. Lett. 1 (1994) 339). Where laws reach farther the list
    grows when it overflows.
    """

    row: int = 16
    mean: int = 8

    def joined(self, other: "ListSizes") -> "ListSizes":
        """Return sizes in which whatever either has room for finds room."""
        return ListSizes(max(self.row, other.row), max(self.mean, other.mean))


@ti.data_oriented
class HalfList:
    """A half list holds the listed pairs of every world: ``index[w, i, k]`` for k below ``size[w, i]``, in
    order of index."""

    def __init__(
        self, s: State, domain: Bound[Domain], laws: tuple[Bound[Pairwise], ...], sizes: ListSizes
    ) -> None:
        self.s, self.domain = s, domain
        self.laws = tuple(law for law in laws if law.data.offers("reach"))
        self.grid, self.spent = CellGrid(s, domain), 1.0 - REACH_PART if self.laws else 1.0
        self.sizes, self.row = sizes, sizes.row
        self.index, self.size, self.stale = (ti.field(ti.i32) for _ in range(3))
        self.longest, self.total = ti.field(ti.i32), ti.field(ti.i64)
        self.since, self.pace, self.moves = ti.field(ti.f64), ti.field(ti.f64), ti.field(ti.i32)
        self.made = ti.field(ti.f64)
        # Images that move past the box lie in other cells than the particles: they are looked for apart.
        self.images = 1 if domain.shears() else 0
        builder = Builder()
        particles = builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity)
        particles.place(self.size)
        particles.dense(ti.k, self.row).place(self.index)
        for column in (self.stale, self.longest, self.total, self.pace, self.moves, self.made):
            builder.dense(ti.i, s.worlds).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, 3).place(self.since)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        per_world = 56 + 4 * self.s.capacity * (1 + self.row)
        return self.s.worlds * per_world + self.grid.bytes()

    @in_taichi_thread
    def wanted(self) -> ListSizes:
        """Return sizes in which the lists last made, which may have overflowed, have room to spare."""
        longest, total = int(self.longest.to_numpy().max()), int(self.total.to_numpy().max())
        row, mean = -(-5 * longest // 4), -(-5 * total // (4 * self.s.capacity))
        return self.sizes.joined(ListSizes(row, mean))

    def forget(self) -> None:
        """Have every list made anew before it is used again: how long the last one lasted is not known."""
        self.stale.fill(1)
        self.moves.fill(0)

    @ti.func
    def reach(self, w, i):
        """Return the widest gap (m) at which a law acts between i and a particle no larger."""
        gap = ti.cast(0.0, self.s.real)
        for law in ti.static(self.laws):
            gap = ti.max(gap, law.reach(self.s, w, i))
        return gap

    @ti.func
    def widest(self, w, i, j):
        """Return the widest distance (m) at which a law acts between two; beyond all in a world that looks
        at all."""
        s, distance = self.s, self.s.radius[w, i] + self.s.radius[w, j]
        if ti.static(len(self.laws) > 0):
            a, b = s.radius[w, i], s.radius[w, j]
            first, second = self.reach(w, i), self.reach(w, j)
            distance += ti.select(a > b, first, ti.select(b > a, second, ti.max(first, second)))
        return ti.select(s.listed_above[w] >= ALL_PAIRS, ti.static(far_away()), distance)

    @ti.func
    def lists(self, w, i, j):
        """Return whether the pair is i's to list."""
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a < b or (a == b and self.s.id[w, i] < self.s.id[w, j])

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        square = ti.cast(0.0, ti.f64)
        self.moves[w] = self.moves[w] + 1
        for k in ti.static(range(3)):
            self.since[w, k] = self.since[w, k] + self.s.displacement[w, k]
            square += self.since[w, k] ** 2
        apart = 2.0 * ti.sqrt(square)
        if ti.static(self.images > 0):
            apart += self.sheared(w, self.s.time[w] + self.s.dt[w] - self.made[w])
        if not (apart <= self.spent * self.grid.skin[w]):
            self.stale[w] = 1

    @ti.func
    def sheared(self, w, elapsed):
        """Return how far (m) shear alone may move two near particles past each other in a time (s)."""
        g, widest = self.grid, ti.cast(0.0, self.s.real)
        for level in range(LEVELS):
            widest = ti.max(widest, g.largest[w, level] + g.widest[w, level])
        return ti.abs(ti.cast(g.domain.shear_rate(w), ti.f64)) * elapsed * (widest + g.skin[w])

    def watch(self) -> tuple[Phase, ...]:
        """Find out whether laws have come to reach farther, where they reach beyond contact at all."""
        return (WatchReach(self.grid, self),) if self.laws else ()

    def phases(self) -> tuple[Phase, ...]:
        """Return the phases that make the rows anew."""
        grid = self.grid
        measure = (NoteReach(grid, self), *measure_phases(grid))
        return (*measure, ChooseSkin(grid, self), *cell_phases(grid), SearchRows(grid, self))


class ChooseSkin(OfGrid):
    """This phase sets the skin: that of the scene, or the one with which steps should cost least.

    A wider skin makes lists last longer, in proportion, and longer to go through. Particles that move by u in
    a step take, of n pairs each that see each other within D, with a skin b

        2 u / b * REBUILD_COST + n (1 + b/D)^3

    times what a pair costs, which is least where b (1 + b/D) = sqrt(2 u D REBUILD_COST / 3 n). Both u and n
    are counts of the list before. No clock is asked, so a run makes its lists in the same steps again.
    """

    def __init__(self, grid: CellGrid, half_list: HalfList) -> None:
        super().__init__(grid)
        self.n = half_list

    @ti.func
    def run(self, w, _k):
        g, n, s = self.g, self.n, self.s
        square = ti.cast(0.0, ti.f64)
        for k in ti.static(range(3)):
            square += n.since[w, k] ** 2
            n.since[w, k] = 0.0
        apart = 2.0 * ti.sqrt(square)
        if ti.static(n.images > 0):
            apart += n.sheared(w, s.time[w] - n.made[w])
        if n.moves[w] > 0:
            n.pace[w] = 0.5 * apart / n.moves[w]
        n.moves[w], n.made[w] = 0, s.time[w]
        chosen = ti.cast(s.skin[w], s.real)
        if chosen <= 0.0:
            distance = g.largest[w, 0] + g.widest[w, 0]
            wider = 1.0 + g.skin[w] / distance
            near = ti.cast(n.total[w], s.real) / (s.count[w] * wider * wider * wider)
            pace = ti.cast(n.pace[w], s.real) / n.spent
            best = pace * REBUILD_COST / (1.5 * distance * ti.max(near, FEWEST_PAIRS))
            part = 0.5 * (ti.sqrt(1.0 + 4.0 * ti.sqrt(best)) - 1.0)
            chosen = distance * ti.max(LEAST_SKIN, ti.min(part, MOST_SKIN))
        g.skin[w] = chosen
        n.longest[w], n.total[w] = 0, 0


class NoteReach(OfParticles):
    """This phase notes how far each particle looks beyond the surface of another."""

    def __init__(self, grid: CellGrid, half_list: HalfList) -> None:
        super().__init__(grid)
        self.n = half_list

    @ti.func
    def run(self, w, i):
        self.g.near[w, i] = self.s.radius[w, i] + self.n.reach(w, i)


class WatchReach(NoteReach):
    """Have the list made anew where particles look farther than it was made for."""

    @ti.func
    def run(self, w, i):
        g = self.g
        farther = self.s.radius[w, i] + self.n.reach(w, i) - g.near[w, i]
        if farther > 0.5 * REACH_PART * g.skin[w]:
            self.n.stale[w] = 1


class SearchRows(OfParticles):
    """This phase lets each particle list those near it that are no smaller."""

    def __init__(self, grid: CellGrid, half_list: HalfList) -> None:
        super().__init__(grid)
        self.n = half_list

    @ti.func
    def run(self, w, i):
        n, s, count = self.n, self.s, 0
        for turn in range(-n.images, n.images + 1):
            count = self.search(w, i, turn, count)
        ti.atomic_add(n.total[w], ti.cast(count, ti.i64))
        if count > n.longest[w]:
            ti.atomic_max(n.longest[w], count)
        if count > n.row:
            s.fail(w, WorldStatus.LIST_OVERFLOW, i)
        n.size[w, i] = ti.min(count, n.row)
        self.order(w, i, n.size[w, i])

    @ti.func
    def search(self, w, i, turn, before):
        """Enter the pairs of i with images of this ``turn`` behind the ``before`` that there are; return how
        many there are then."""
        n, g, s, count, t = self.n, self.g, self.s, before, self.s.time[w]
        place, radius, skin = s.position[w, i], s.radius[w, i], g.skin[w]
        r = g.domain.seen_from(w, place, turn, t)
        for level in range(g.level(w, radius), LEVELS):
            if g.population[w, level] > 0:
                reach = radius + g.widest[w, level] + skin
                first, cells = ti.Vector.zero(ti.i32, 3), ti.Vector.zero(ti.i32, 3)
                for k in ti.static(range(3)):
                    dims, width = g.dims[w, level, k], g.cell[w, level, k]
                    a = ti.floor((r[k] - reach - g.low[w, k]) / width, ti.i32)
                    b = ti.floor((r[k] + reach - g.low[w, k]) / width, ti.i32)
                    if ti.static(not g.joined[k]):
                        a, b = ti.max(a, 0), ti.min(b, dims - 1)
                    if b - a >= dims or s.listed_above[w] >= ALL_PAIRS:
                        # Around the whole box: each cell once.
                        a, b = 0, dims - 1
                    first[k], cells[k] = a, ti.max(0, b - a + 1)
                for zy in range(cells[2] * cells[1]):
                    z = self.inside(first[2] + zy // cells[1], g.dims[w, level, 2])
                    y = self.inside(first[1] + zy % cells[1], g.dims[w, level, 1])
                    row, dims = g.row(w, level, z, y), g.dims[w, level, 0]
                    # Cells of a row follow each other in memory; across a joined face it is two stretches.
                    x, left = self.inside(first[0], dims), cells[0]
                    while left > 0:
                        length = ti.min(left, dims - x)
                        for m in range(g.cell_start[w, row + x], g.cell_start[w, row + x + length]):
                            j = g.order[w, m]
                            if n.lists(w, i, j):
                                limit = n.widest(w, i, j) + skin
                                # Not as forces see it: the next step may take either through a face.
                                d = g.domain.nearest(w, place, s.position[w, j], t)
                                here = g.domain.turn(w, place, s.position[w, j]) == turn
                                if here and d.norm_sqr() <= limit * limit:
                                    if count < n.row:
                                        n.index[w, i, count] = j
                                    count += 1
                        left -= length
                        x = 0
        return count

    @ti.func
    def inside(self, c, cells):
        """Return the index of a cell that may lie across a joined face, by less than one turn."""
        return c + ti.select(c < 0, cells, 0) - ti.select(c >= cells, cells, 0)

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
