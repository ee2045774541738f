"""Pairs with nearby surfaces, for events and step control: all pairs in small worlds, neighbour rows in
others.

A list is rebuilt when particles have moved, relative to the frame of the world, so far that a missing pair
could matter. The skin along each axis is chosen for some steps. If all particles move at nearly the same
velocity, almost no skin is needed.
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
"""Worlds of at most this many particles check all pairs; initial value of ``listed_above``."""
HORIZON = 0.15
"""Every pair within this gap is offered, in units of the mean distance between particles."""
STEPS_OF_SKIN = 3.0
"""Intended lifetime of a list in steps; the skin along each axis is the displacement in this many steps."""


@ti.data_oriented
class NearList(NeighbourRows):
    """The near list offers the near pairs of every world.

    gap : gap between surfaces (m) within which the list has every pair until it is rebuilt.
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
        """Return whether a world uses a list instead of checking all pairs."""
        return self.s.count[w] > self.s.listed_above[w]

    @ti.func
    def offered(self, w, i, listed):
        """Return the number of candidates that ``candidate`` offers to particle i."""
        n = self.s.count[w]
        if listed:
            n = self.size[w, i]
        return n

    @ti.func
    def candidate(self, w, i, k, listed):
        """Return the k-th candidate near i; without a list, particle k."""
        j = k
        if listed:
            j = self.index[w, i, k]
        return j

    @ti.func
    def leads(self, w, i, j):
        """Return whether i is first in the pair: the larger particle, or at equal size the one of lower
        index."""
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a > b or (a == b and i < j)

    @ti.func
    def spacing(self, w):
        """Return the mean distance (m) between particles: the cube root of the initial volume per
        particle."""
        return ti.cast(elementary.pow(self.s.volume[w] / self.s.count[w], 1.0 / 3.0), self.s.real)

    @ti.func
    def horizon(self, w):
        """Return the gap between surfaces (m) within which every pair is offered."""
        return HORIZON * self.spacing(w)

    @ti.func
    def sure(self, w):
        """Return ``horizon`` (m) in a world with a list; 0, for no limit, if all pairs are offered."""
        return ti.select(self.listed(w), self.horizon(w), 0.0)

    @ti.func
    def moved(self, w):
        """Record that particles have moved by at most ``displacement`` relative to the frame, along each
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
        # Between equal particles each one lists half of the pairs.
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a < b or (a == b and (i < j) != ((i + j) % 2 > 0))

    @ti.func
    def sees(self, d, distance, skin):
        rest = ti.max(ti.abs(d) - skin, 0.0)
        return rest.norm_sqr() <= distance * distance


def update_near_list(near: NearList) -> tuple[Item, ...]:
    """Return the items that rebuild the list if this is due."""
    grid = near.grid
    measure = (BeginNearList(near), *measure_phases(grid, near), ChooseSkinByAxis(near))
    return (RebuildNearList(near, (*measure, *cell_phases(grid), *search_rows(near), EndNearList(near))),)


class RebuildNearList(Repeat):
    """This item rebuilds the list of a world once if this is due."""

    def __init__(self, near: NearList, items: tuple[Phase, ...]) -> None:
        super().__init__(items)
        self.near = near

    @ti.func
    def pending(self, w):
        return ti.select(self.near.listed(w), self.near.stale[w], 0)


class OfNearList(OfGrid):
    """Base of the phases that work on the near list of a world."""

    def __init__(self, near: NearList) -> None:
        super().__init__(near.grid)
        self.n = near


class BeginNearList(OfNearList):
    """This phase sets the gap within which pairs are listed."""

    @ti.func
    def run(self, w, _k):
        self.n.gap[w] = self.n.horizon(w)


class ChooseSkinByAxis(OfNearList):
    """This phase chooses the skin along each axis: the displacement in some steps like the last one, at most
    the mean distance."""

    @ti.func
    def run(self, w, _k):
        g, n, s = self.g, self.n, self.s
        extent = ti.cast(ti.max(g.extent(w), 1e-3 * g.smallest[w]), ti.f64)
        volume = extent[0] * extent[1] * extent[2] / s.count[w]
        spacing = ti.cast(elementary.pow(volume, 1.0 / 3.0), s.real)
        for k in ti.static(range(3)):
            g.skin[w, k] = ti.min(2.0 * n.ahead * ti.cast(s.displacement[w, k], s.real), spacing)


class EndNearList(OfNearList):
    """This phase marks the list as up to date."""

    @ti.func
    def run(self, w, _k):
        self.n.stale[w] = 0
        for k in ti.static(range(3)):
            self.n.since[w, k] = 0.0
