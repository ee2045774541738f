"""Pairs whose surfaces are near, for events and step control: all pairs in small worlds, rows in others.

A list is made anew when particles have moved, relative to the world's own frame, so far that a pair it lacks
could matter. Along each axis it is meant to last some steps: one in which all fly at much the same speed
needs no skin to speak of.
"""

from __future__ import annotations

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.numerics import elementary
from tisim.pairs.cell_grid import OfGrid
from tisim.pairs.cell_phases import cell_phases, measure_phases
from tisim.pairs.neighbour_rows import NeighbourRows, search_rows
from tisim.program.phases import Item, Phase, Repeat
from tisim.state.bound import Bound
from tisim.state.state import State

SMALL_WORLD = 48
"""Worlds of at most this many particles look at all pairs; ``listed_above`` of the state is this at first."""
HORIZON = 0.15
"""Every pair is sure to be offered within this gap, in mean distances between particles."""
STEPS_OF_SKIN = 3.0
"""A list is meant to last this many steps: its skin along each axis is what particles move in them."""


@ti.data_oriented
class NearList(NeighbourRows):
    """The near list offers the near pairs of every world.

    gap : between surfaces (m), within which the list has every pair until it is made anew.
    """

    def __init__(self, s: State, domain: Bound[Domain], row: int) -> None:
        super().__init__(s, domain, row)
        self.ahead, self.gap = STEPS_OF_SKIN, ti.field(s.real)
        builder = Builder()
        builder.dense(ti.i, s.worlds).place(self.gap)
        self.own = Tree(builder)

    def bytes(self) -> int:
        return super().bytes() + self.own.bytes

    @ti.func
    def listed(self, w):
        """Return whether a world has a list, and does not look at all pairs."""
        return self.s.count[w] > self.s.listed_above[w]

    @ti.func
    def offered(self, w, i, listed):
        """Return how many candidates ``candidate`` offers particle i."""
        n = self.s.count[w]
        if listed:
            n = self.size[w, i]
        return n

    @ti.func
    def candidate(self, w, i, k, listed):
        """Return the k-th particle that may be near i; in a world that looks at all pairs, any."""
        j = k
        if listed:
            j = self.index[w, i, k]
        return j

    @ti.func
    def leads(self, w, i, j):
        """Return whether i comes first in the pair: the larger does, and of equals the lower index."""
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a > b or (a == b and i < j)

    @ti.func
    def spacing(self, w):
        """Return the mean distance (m) between particles: the cube root of the volume at the start for
        each."""
        return ti.cast(elementary.pow(self.s.volume[w] / self.s.count[w], 1.0 / 3.0), self.s.real)

    @ti.func
    def horizon(self, w):
        """Return the gap between surfaces (m) within which every pair is sure to be offered."""
        return HORIZON * self.spacing(w)

    @ti.func
    def sure(self, w):
        """Return ``horizon`` (m) where only near pairs are offered; 0, for no limit, where all pairs are."""
        return ti.select(self.listed(w), self.horizon(w), 0.0)

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        for k in ti.static(range(3)):
            self.since[w, k] = self.since[w, k] + self.s.displacement[w, k]
            if not (2.0 * self.since[w, k] <= self.grid.skin[w, k]):
                self.stale[w] = 1

    @ti.func
    def reach(self, w, i):
        return self.gap[w]

    @ti.func
    def lists(self, w, i, j):
        # Of equals each lists half of those around it.
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a < b or (a == b and (i < j) != ((i + j) % 2 > 0))

    @ti.func
    def sees(self, d, distance, skin):
        rest = ti.max(ti.abs(d) - skin, 0.0)
        return rest.norm_sqr() <= distance * distance


def update_near_list(near: NearList) -> tuple[Item, ...]:
    """Return the items that bring the list up to date where it is due."""
    grid = near.grid
    measure = (BeginNearList(near), *measure_phases(grid, near), ChooseSkinByAxis(near))
    return (RebuildNearList(near, (*measure, *cell_phases(grid), *search_rows(near), EndNearList(near))),)


class RebuildNearList(Repeat):
    """This item makes the list of a world anew, once, when it is due."""

    def __init__(self, near: NearList, items: tuple[Phase, ...]) -> None:
        super().__init__(items)
        self.near = near

    @ti.func
    def pending(self, w):
        return ti.select(self.near.listed(w), self.near.stale[w], 0)


class OfNearList(OfGrid):
    """This phase works on the near list of a world."""

    def __init__(self, near: NearList) -> None:
        super().__init__(near.grid)
        self.n = near


class BeginNearList(OfNearList):
    """This phase notes within which gap pairs are to be listed."""

    @ti.func
    def run(self, w, _k):
        self.n.gap[w] = self.n.horizon(w)


class ChooseSkinByAxis(OfNearList):
    """This phase chooses the skin along each axis: what particles move in some steps like the last one, and
    at most their mean distance."""

    @ti.func
    def run(self, w, _k):
        g, n, s = self.g, self.n, self.s
        extent = ti.cast(ti.max(g.extent(w), 1e-3 * g.smallest[w]), ti.f64)
        volume = extent[0] * extent[1] * extent[2] / s.count[w]
        spacing = ti.cast(elementary.pow(volume, 1.0 / 3.0), s.real)
        for k in ti.static(range(3)):
            g.skin[w, k] = ti.min(2.0 * n.ahead * ti.cast(s.displacement[w, k], s.real), spacing)


class EndNearList(OfNearList):
    """This phase declares the list as good as new."""

    @ti.func
    def run(self, w, _k):
        self.n.stale[w] = 0
        for k in ti.static(range(3)):
            self.n.since[w, k] = 0.0
