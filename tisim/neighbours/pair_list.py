"""Pairs whose surfaces are near: all pairs for small worlds, a cell list with a skin for larger ones.

Each pair is listed once, by its larger member (of equals, the lower index). A particle then searches only
as far as twice its own radius, so a few large grains among many small ones cost no more than their volume.
A list is made anew when particles have moved, relative to the world's own frame, so far that a pair it
lacks could matter. What is done with a pair depends on its true distance, never on whether the list was
due: results do not depend on when lists were made, and a restarted run keeps its bits.
"""

from __future__ import annotations

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.domain import Domain
from tisim.numerics import elementary
from tisim.worlds.bound import Bound
from tisim.worlds.state import State

SMALL_WORLD = 48
"""Worlds of at most this many particles look at all pairs; ``listed_above`` of the state is this at first."""
MOST_NEIGHBOURS = 24
"""A particle can list this many neighbours; one with more of them looks at all particles."""
HORIZON = 0.15
"""Every pair is sure to be offered within this gap, in mean distances between particles."""
STEPS_OF_SKIN = 2.0
"""A list is meant to last this many steps: its skin along each axis is what particles move in them."""
CELLS_PER_PARTICLE = 2


@ti.data_oriented
class NeighbourList:
    """The neighbour list holds the near pairs of every world."""

    def __init__(self, s: State, domain: Bound[Domain]) -> None:
        self.s, self.domain, self.joined = s, domain, domain.joined()
        worlds, capacity = s.worlds, s.capacity
        self.max_cells = CELLS_PER_PARTICLE * capacity + 8
        self.room, self.ahead = MOST_NEIGHBOURS, STEPS_OF_SKIN
        builder = Builder()
        self.cell_start, self.cell_of, self.order, self.neighbour_count = (ti.field(ti.i32) for _ in range(4))
        self.neighbour_index = ti.field(ti.i32)
        self.dims = ti.Vector.field(3, ti.i32)
        self.corner, self.cell = ti.Vector.field(3, s.real), ti.Vector.field(3, s.real)
        self.sorted_position, self.sorted_radius = ti.Vector.field(3, s.real), ti.field(s.real)
        self.skin = ti.Vector.field(3, s.real)
        self.gap = ti.field(s.real)
        self.stale = ti.field(ti.i32)
        builder.dense(ti.i, worlds).dense(ti.j, self.max_cells + 1).place(self.cell_start)
        for column in (
            self.cell_of,
            self.order,
            self.neighbour_count,
            self.sorted_position,
            self.sorted_radius,
        ):
            builder.dense(ti.i, worlds).dense(ti.j, capacity).place(column)
        builder.dense(ti.i, worlds).dense(ti.j, capacity).dense(ti.k, self.room + 1).place(
            self.neighbour_index
        )
        for column in (self.dims, self.corner, self.cell, self.skin, self.gap, self.stale):
            builder.dense(ti.i, worlds).place(column)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes

    @in_taichi_thread
    def forget(self) -> None:
        """Have every list made anew before it is used again."""
        self.stale.fill(1)

    @ti.func
    def invalidate(self, w):
        """Have the list of a world made anew before it is used again."""
        self.stale[w] = 1

    @ti.func
    def owns(self, w, i, j):
        """Return whether the pair is i's to list."""
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a > b or (a == b and i < j)

    @ti.func
    def size(self, w, i):
        """Return how many candidates ``candidate`` offers particle i."""
        n = self.s.count[w]
        if n > self.s.listed_above[w] and self.neighbour_count[w, i] >= 0:
            n = self.neighbour_count[w, i]
        return n

    @ti.func
    def candidate(self, w, i, k):
        """Return the k-th particle that may be a neighbour owned by i; i itself where there is none."""
        j = k
        if self.s.count[w] > self.s.listed_above[w] and self.neighbour_count[w, i] >= 0:
            j = self.neighbour_index[w, i, k]
        elif not self.owns(w, i, k):
            j = i
        return j

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
        return ti.select(self.s.count[w] > self.s.listed_above[w], self.horizon(w), 0.0)

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``displacement`` relative to the frame, along each
        axis."""
        for k in ti.static(range(3)):
            self.s.displacement_since_list[w, k] = (
                self.s.displacement_since_list[w, k] + self.s.displacement[w, k]
            )
            if 2.0 * self.s.displacement_since_list[w, k] > self.skin[w][k]:
                self.stale[w] = 1

    @ti.func
    def place(self, w, r):
        """Return the index of the cell along each axis."""
        c = ti.floor((r - self.corner[w]) / self.cell[w], ti.i32)
        return ti.max(0, ti.min(c, self.dims[w] - 1))

    @ti.func
    def around(self, c, cells):
        """Return the index of a cell that may lie across a joined face, by less than one turn."""
        return c + ti.select(c < 0, cells, 0) - ti.select(c >= cells, cells, 0)

    @ti.func
    def turns(self, c, cells):
        """Return which image of the box a cell lies in, along each axis: -1, 0 or 1."""
        return ti.select(c >= cells, 1, 0) - ti.select(c < 0, 1, 0)
