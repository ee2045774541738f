"""Rows of neighbours, as long as needed: what all lists of pairs have in common.

A particle lists those at least as large as itself, of which few find room around it, so rows are short
whatever the ratio of sizes. A row that is too short stops its world, and lists are made longer
(CompiledWorlds.grow_lists). What a pair does depends on its distance, never on whether the list was due:
results do not depend on when lists were made.
"""

from __future__ import annotations

from typing import ClassVar

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.domains.domain import Domain
from tisim.pairs.cell_grid import LEVELS, CellGrid
from tisim.state.bound import Bound
from tisim.state.state import State

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
