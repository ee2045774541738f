"""Pairs that short-ranged forces may act between, each listed once, by its smaller particle.

A particle lists those at least as large as itself (of equals, those of higher id), of which few find room
around it, so rows are short whatever the ratio of sizes. A list is made anew when particles have moved so far
that a pair it lacks could matter; the skin says how far that is. What a pair does depends on its distance,
never on whether the list was due: results do not depend on when lists were made.
"""

from dataclasses import dataclass

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.domain import Domain
from tisim.effects.base import Pairwise
from tisim.neighbours.cell_grid import LEVELS, CellGrid
from tisim.numerics.ieee import far_away
from tisim.worlds.bound import Bound
from tisim.worlds.state import State

ALL_PAIRS = 2**30
"""This is the ``listed_above`` of a world in which all pairs are listed, however far apart."""
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
        self.laws = tuple(law for law in laws if law.data.reaches())
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
        return self.tree.bytes + self.grid.bytes()

    @in_taichi_thread
    def wanted(self) -> ListSizes:
        """Return sizes in which the lists last made, which may have overflowed, have room to spare."""
        longest, total = int(self.longest.to_numpy().max()), int(self.total.to_numpy().max())
        row, mean = -(-5 * longest // 4), -(-5 * total // (4 * self.s.capacity))
        return self.sizes.joined(ListSizes(row, mean))

    @in_taichi_thread
    def outlook(self) -> np.ndarray:
        """Return how far (m) each particle looked from its centre when lists were last made."""
        farthest: np.ndarray = self.grid.near.to_numpy()
        return farthest

    def forget(self) -> None:
        """Have every list made anew before it is used again, as the first of a run: nothing is known of how
        fast particles move."""
        self.stale.fill(1)
        self.moves.fill(0)
        self.pace.fill(0.0)

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
