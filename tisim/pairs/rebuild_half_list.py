"""The phases that make a half list anew, with a skin chosen for it."""

from tisim.backend.taichi import ti
from tisim.pairs.cell_grid import OfGrid, OfParticles
from tisim.pairs.cell_phases import cell_phases, measure_phases
from tisim.pairs.half_list import REACH_PART, HalfList
from tisim.pairs.search_rows import search_rows
from tisim.program.phases import Phase

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
    return (WatchReach(half_list),) if half_list.laws else ()


def rebuild_half_list(half_list: HalfList) -> tuple[Phase, ...]:
    """Return the phases that make the list anew."""
    grid = half_list.grid
    measure = (*measure_phases(grid, half_list), ChooseSkin(half_list))
    return (*measure, *cell_phases(grid), *search_rows(half_list))


class ChooseSkin(OfGrid):
    """This phase sets the skin: that of the scene, or the one with which steps should cost least.

    A wider skin makes lists last longer, in proportion, and longer to go through. Particles that move by u in
    a step take, of n pairs each that see each other within D, with a skin b

        2 u / b * REBUILD_COST + n (1 + b/D)^3

    times what a pair costs, which is least where b (1 + b/D) = sqrt(2 u D REBUILD_COST / 3 n). Both u and n
    are counts of the list before. No clock is asked, so a run makes its lists in the same steps again.
    """

    def __init__(self, half_list: HalfList) -> None:
        super().__init__(half_list.grid)
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
            wider = 1.0 + g.skin[w, 0] / distance
            near = ti.cast(n.total[w], s.real) / (s.count[w] * wider * wider * wider)
            pace = ti.cast(n.pace[w], s.real) / n.spent
            best = pace * REBUILD_COST / (1.5 * distance * ti.max(near, FEWEST_PAIRS))
            part = 0.5 * (ti.sqrt(1.0 + 4.0 * ti.sqrt(best)) - 1.0)
            chosen = distance * ti.max(LEAST_SKIN, ti.min(part, MOST_SKIN))
        for k in ti.static(range(3)):
            g.skin[w, k] = chosen


class WatchReach(OfParticles):
    """This phase has the list made anew where particles look farther than it was made for."""

    def __init__(self, half_list: HalfList) -> None:
        super().__init__(half_list.grid)
        self.n = half_list

    @ti.func
    def run(self, w, i):
        g = self.g
        farther = self.s.radius[w, i] + self.n.reach(w, i) - g.near[w, i]
        if farther > 0.5 * REACH_PART * g.skin[w, 0]:
            self.n.stale[w] = 1
