"""Particles of large worlds are sorted in memory by position, so that neighbours are close in memory.

Each world is sorted every SORT_EVERY steps from its first step on, by bricks of cells. In a dense bed a brick
has about the particle number of a chunk of pairs, so few pairs belong to two chunks. The order depends on the
state of the world alone, so runs are bitwise reproducible: alone, in a batch or after a restart. The last
digits of sums depend on this order. Output by particle, such as a Result, is in the order of ids, which is
the order in the initial state.
"""

from typing import Any

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.pairs.cell_grid import CellGrid, OfGrid, OfParticles
from tisim.pairs.cell_phases import cell_phases, measure_phases
from tisim.pairs.lists import NeighbourLists
from tisim.pairs.pair_chunks import PairChunks
from tisim.pairs.rebuild_pairs import BeginRebuild, StoreMemory
from tisim.program.phases import Item, Repeat

SORTED_FROM = 4096
"""Worlds of at least this many particles are sorted; in smaller ones all particles fit into the cache."""
SORT_EVERY = 4096
"""Steps between two sorts of a world; they take some hundred times as long as the sort."""
COLUMNS_AT_ONCE = 8
"""Numbers of a particle that are moved at once."""
BRICK = 8
"""Cells of a brick along each axis."""


@ti.data_oriented
class BrickGrid(CellGrid):
    """A brick grid numbers cells brick by brick; the last brick along an axis may be thinner."""

    def shared(self) -> bool:
        # All threads sort a world together.
        return True

    @ti.func
    def divide(self, cells, most):
        # The order, and with it the last digits of sums, must not depend on the cells chosen for fast
        # searches.
        dims = ti.max(1, ti.floor(cells, ti.i32))
        while dims[0] * dims[1] * dims[2] > most:
            dims = (dims + 1) // 2
        return dims

    @ti.func
    def cell_index(self, w, level, at):
        index, cells, inner = self.offset[w, level], 1, 0
        for k in ti.static(range(3)):
            cells *= self.dims[w, level, k]
        for k in ti.static((2, 1, 0)):
            dims, begin = self.dims[w, level, k], at[k] // BRICK * BRICK
            thick = ti.min(BRICK, dims - begin)
            # Count the cells of the earlier bricks along this axis, in this brick along the previous axes.
            cells = cells // dims
            index += begin * cells
            cells *= thick
            inner = inner * thick + at[k] - begin
        return index + inner


@ti.data_oriented
class SpatialSort:
    """A spatial sort permutes all fields of the particles, one group of columns after the other.

    due : whether a world is being sorted. stage : index of the current group of columns.
    gathered : a copy of these columns.
    """

    def __init__(self, pairs: PairChunks, lists: NeighbourLists) -> None:
        s = pairs.s
        self.s, self.pairs, self.lists = s, pairs, lists
        self.grid = BrickGrid(s, pairs.half_list.domain)
        self.least, self.every = SORTED_FROM, SORT_EVERY
        singles: list[tuple[Any, Any]] = []
        for field in s.fields:
            if not (field.slots or field.lookup):
                column = getattr(s, field.name)
                parts = [column.get_scalar_field(k) for k in range(3)] if field.components == 3 else [column]
                singles += [(part, part.dtype) for part in parts]
        self.groups = tuple(
            tuple(singles[k : k + COLUMNS_AT_ONCE]) for k in range(0, len(singles), COLUMNS_AT_ONCE)
        )
        self.stages = len(self.groups)
        self.slotted: tuple[tuple[Any, int, int, Any], ...] = ()
        for column, slots, _ in s.slotted:
            self.slotted += ((column, slots, self.stages, column.dtype),)
            self.stages += -(-slots // COLUMNS_AT_ONCE)
        self.due, self.stage, self.gathered = ti.field(ti.i32), ti.field(ti.i32), ti.field(ti.f64)
        builder = Builder()
        builder.dense(ti.i, s.worlds).place(self.due, self.stage)
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).dense(ti.k, COLUMNS_AT_ONCE).place(
            self.gathered
        )
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.grid.bytes()

    def items(self) -> tuple[Item, ...]:
        """Return the items that sort the worlds that are due, between two steps."""
        grid, pairs = self.grid, self.pairs
        store = (StoreMemory(pairs),) if pairs.memories else ()
        cells = (*measure_phases(grid, pairs.half_list), DropSkin(grid), *cell_phases(grid))
        permute = PermuteColumns(
            self, (GatherColumns(grid, self), WriteColumns(grid, self), EndColumns(grid, self))
        )
        sort = (*store, BeginRebuild(pairs), *cells, permute, EndSort(grid, self))
        return BeginSort(grid, self), SortWorlds(self, sort)


class SortWorlds(Repeat):
    """This item sorts the worlds that are due, once."""

    usual = 0

    def __init__(self, sort: SpatialSort, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.sort = sort

    @ti.func
    def pending(self, w):
        return self.sort.due[w]


class PermuteColumns(Repeat):
    """This item permutes one group of columns after the other."""

    def __init__(self, sort: SpatialSort, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.sort, self.usual = sort, sort.stages

    @ti.func
    def pending(self, w):
        return self.sort.stages - self.sort.stage[w]


class BeginSort(OfGrid):
    """This phase decides whether a world is due."""

    def __init__(self, grid: CellGrid, sort: SpatialSort) -> None:
        super().__init__(grid)
        self.sort = sort

    @ti.func
    def run(self, w, _k):
        due = self.s.count[w] >= self.sort.least and self.s.steps[w] % self.sort.every == 0
        self.sort.due[w], self.sort.stage[w] = ti.cast(due, ti.i32), 0


class DropSkin(OfGrid):
    """This phase sets the skin to 0: the skin depends on when lists were made, and the order must not."""

    @ti.func
    def run(self, w, _k):
        for k in ti.static(range(3)):
            self.g.skin[w, k] = 0.0


class GatherColumns(OfParticles):
    """This phase reads columns in the new order: by cell, and by index within a cell."""

    def __init__(self, grid: CellGrid, sort: SpatialSort) -> None:
        super().__init__(grid)
        self.sort = sort

    @ti.func
    def run(self, w, i):
        sort, source, stage = self.sort, self.g.order[w, i], self.sort.stage[w]
        for index, group in ti.static(enumerate(sort.groups)):
            if stage == index:
                for k, part in ti.static(enumerate(group)):
                    sort.gathered[w, i, k] = ti.cast(part[0][w, source], ti.f64)
        for column in ti.static(sort.slotted):
            first = (stage - column[2]) * COLUMNS_AT_ONCE
            if first >= 0:
                for k in range(first, ti.min(first + COLUMNS_AT_ONCE, column[1])):
                    sort.gathered[w, i, k - first] = ti.cast(column[0][w, source, k], ti.f64)


class WriteColumns(GatherColumns):
    """This phase writes the columns in the new order."""

    @ti.func
    def run(self, w, i):
        sort, stage = self.sort, self.sort.stage[w]
        for index, group in ti.static(enumerate(sort.groups)):
            if stage == index:
                for k, part in ti.static(enumerate(group)):
                    part[0][w, i] = ti.cast(sort.gathered[w, i, k], part[1])
        for column in ti.static(sort.slotted):
            first = (stage - column[2]) * COLUMNS_AT_ONCE
            if first >= 0:
                for k in range(first, ti.min(first + COLUMNS_AT_ONCE, column[1])):
                    column[0][w, i, k] = ti.cast(sort.gathered[w, i, k - first], column[3])


class EndColumns(BeginSort):
    """This phase advances to the next group of columns."""

    @ti.func
    def run(self, w, _k):
        self.sort.stage[w] = self.sort.stage[w] + 1


class EndSort(BeginSort):
    """This phase ends the sort of a world, and has its lists rebuilt."""

    @ti.func
    def run(self, w, _k):
        self.sort.due[w] = 0
        self.sort.lists.invalidate(w)
