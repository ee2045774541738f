"""The phases that make a list of pairs anew: they choose its skin, and search around each particle."""

from tisim.backend.taichi import ti
from tisim.neighbours.cell_grid import LEVELS, CellGrid, OfGrid, OfParticles, cell_phases, measure_phases
from tisim.neighbours.half_list import ALL_PAIRS, REACH_PART, HalfList
from tisim.worlds.phases import Phase
from tisim.worlds.status import WorldStatus

REBUILD_COST = 100.0
"""Making a list takes, for each particle, as long as this many listed pairs take in a step that do not act on
each other. Measured in a bed of grains (docs/performance.md): some 900 ns beside 9."""
LEAST_SKIN, MOST_SKIN = 0.01, 0.5
"""These bound the skin, in distances at which two of the smallest particles see each other."""
FEWEST_PAIRS = 1.0
"""So many pairs of each particle are taken to see each other, where there are fewer: they may come to."""


def watch_reach(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phase that finds out whether laws have come to reach farther, where they reach beyond
    contact at all."""
    return (WatchReach(half_list.grid, half_list),) if half_list.laws else ()


def search_rows(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phases that make the rows anew."""
    grid = half_list.grid
    measure = (NoteReach(grid, half_list), *measure_phases(grid))
    return (*measure, ChooseSkin(grid, half_list), *cell_phases(grid), SearchRows(grid, half_list))


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
