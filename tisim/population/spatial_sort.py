"""Particles of large worlds are sorted in memory by where they are, so that neighbours lie near each other.

It is done every so many steps of a world, from its first on, by bricks of cells. In a dense bed a brick has
about as many particles as a chunk of pairs, so few pairs are between chunks. The order follows from the state
of the world alone, so a run has the same bits again, alone, in a batch or restarted. Sums are ordered by
place in memory: their last digits are those of this order. What is asked for by particle, such as a Result,
is in the order of ids, which is that of the start.
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
"""Worlds of at least this many particles are sorted: where all fit into the cache, order is worth nothing."""
SORT_EVERY = 4096
"""A world is sorted each time after so many steps, which take some hundred times as long."""
COLUMNS_AT_ONCE = 8
"""So many numbers of a particle are moved at once."""
BRICK = 8
"""A brick has so many cells along each axis."""


@ti.data_oriented
class BrickGrid(CellGrid):
    """A brick grid numbers cells brick by brick; the last brick along an axis may be thinner."""

    def shared(self) -> bool:
        # Worlds are always sorted by all threads.
        return True

    @ti.func
    def divide(self, cells, most):
        # The order, and so last digits, must not go by how cells are best searched.
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
            # Of the bricks at this place along the axes before, those that come first along this one.
            cells = cells // dims
            index += begin * cells
            cells *= thick
            inner = inner * thick + at[k] - begin
        return index + inner


@ti.data_oriented
class SpatialSort:
    """A spatial sort permutes all fields of the particles, some columns of numbers after the others.

    due : whether a world is being sorted. stage : says which columns' turn it is. gathered : a copy of these.
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
        """Return the items that sort the worlds whose turn it is; between two steps."""
        grid, pairs = self.grid, self.pairs
        store = (StoreMemory(pairs),) if pairs.memories else ()
        cells = (*measure_phases(grid, pairs.half_list), DropSkin(grid), *cell_phases(grid))
        permute = PermuteColumns(
            self, (GatherColumns(grid, self), WriteColumns(grid, self), EndColumns(grid, self))
        )
        sort = (*store, BeginRebuild(pairs), *cells, permute, EndSort(grid, self))
        return BeginSort(grid, self), SortWorlds(self, sort)


class SortWorlds(Repeat):
    """This item sorts the worlds whose turn it is, once."""

    usual = 0

    def __init__(self, sort: SpatialSort, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.sort = sort

    @ti.func
    def pending(self, w):
        return self.sort.due[w]


class PermuteColumns(Repeat):
    """This item permutes some columns after the others."""

    def __init__(self, sort: SpatialSort, items: tuple[Item, ...]) -> None:
        super().__init__(items)
        self.sort, self.usual = sort, sort.stages

    @ti.func
    def pending(self, w):
        return self.sort.stages - self.sort.stage[w]


class BeginSort(OfGrid):
    """This phase asks whether it is the turn of a world."""

    def __init__(self, grid: CellGrid, sort: SpatialSort) -> None:
        super().__init__(grid)
        self.sort = sort

    @ti.func
    def run(self, w, _k):
        due = self.s.count[w] >= self.sort.least and self.s.steps[w] % self.sort.every == 0
        self.sort.due[w], self.sort.stage[w] = ti.cast(due, ti.i32), 0


class DropSkin(OfGrid):
    """Cells are those of the laws alone: the skin depends on when lists were made."""

    @ti.func
    def run(self, w, _k):
        for k in ti.static(range(3)):
            self.g.skin[w, k] = 0.0


class GatherColumns(OfParticles):
    """This phase reads columns in the new order: along cells, and by index within a cell."""

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
    """This phase writes the columns."""

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
    """After this phase it is the turn of the next columns."""

    @ti.func
    def run(self, w, _k):
        self.sort.stage[w] = self.sort.stage[w] + 1


class EndSort(BeginSort):
    """After this phase a world is sorted, and its lists are made anew."""

    @ti.func
    def run(self, w, _k):
        self.sort.due[w] = 0
        self.sort.lists.invalidate(w)
