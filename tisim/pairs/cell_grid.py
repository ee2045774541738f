"""Particles are sorted into cells, with a separate grid level of cells for each size class.

A level holds the radii within a factor of two, and its cells are as wide as the search range between two of
its particles. The cost of a search therefore depends on the particles nearby and not on the size ratio. The
phases that fill the cells are in cell_phases.py.
"""

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.program.phases import Phase
from tisim.program.scans import PrefixSum
from tisim.state.bound import Bound
from tisim.state.state import State

LEVELS = 8
"""Number of grid levels. Radii more than 2^7 times the smallest share the last level."""
CELLS_PER_PARTICLE, SPARE_CELLS = 2, 8
"""A level of n particles has at most CELLS_PER_PARTICLE * n + SPARE_CELLS cells."""
BINNED_TOGETHER = {"cpu": 512}
"""Particles measured by one task, one after the other; 1 on other devices."""


@ti.data_oriented
class CellGrid:
    """A cell grid holds the cells of every world.

    order : indices of the particles, cell by cell; the particles of cell c begin at ``cell_start[w, c]``.
    near : radius of each particle plus its interaction range beyond the surface of another one, m.
    skin : neighbour-list skin distance along each axis, m.
    """

    def __init__(self, s: State, domain: Bound[Domain]) -> None:
        self.s, self.domain, self.joined = s, domain, domain.cyclic()
        self.max_cells = CELLS_PER_PARTICLE * s.capacity + SPARE_CELLS * LEVELS
        self.block = BINNED_TOGETHER.get(runtime.current().device, 1)
        builder = Builder()
        self.near, self.skin, self.smallest = (ti.field(s.real) for _ in range(3))
        self.low, self.high, self.cell, self.widest, self.largest = (ti.field(s.real) for _ in range(5))
        self.cell_start, self.cell_of, self.rank, self.order = (ti.field(ti.i32) for _ in range(4))
        self.population, self.offset, self.dims, self.total = (ti.field(ti.i32) for _ in range(4))
        for column in (self.near, self.cell_of, self.rank, self.order):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.max_cells + 1).place(self.cell_start)
        for column in (self.smallest, self.total):
            builder.dense(ti.i, s.worlds).place(column)
        for column in (self.low, self.high, self.skin):
            builder.dense(ti.i, s.worlds).dense(ti.j, 3).place(column)
        levels = builder.dense(ti.i, s.worlds).dense(ti.j, LEVELS)
        for column in (self.widest, self.largest, self.population, self.offset):
            levels.place(column)
        for column in (self.dims, self.cell):
            levels.dense(ti.k, 3).place(column)
        self.tree = Tree(builder)
        # First place of each cell in ``order``: the sum of the counts of the cells before it.
        self.starts = PrefixSum(s, OfCells(self), self.cell_start, self.cell_start)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.starts.bytes()

    def shared(self) -> bool:
        """Return whether several threads may work on the cells of one world."""
        return self.s.shared

    @ti.func
    def level(self, w, radius):
        """Return the level of a particle of this radius."""
        size, level = radius, 0
        while size >= 2.0 * self.smallest[w] and level < LEVELS - 1:
            size *= 0.5
            level += 1
        return level

    @ti.func
    def place(self, w, level, r):
        """Return the index of the cell of a level along each axis."""
        return ti.max(0, ti.min(self.floor_of(w, level, r), self.dims_of(w, level) - 1))

    @ti.func
    def floor_of(self, w, level, r):
        """Return the index along each axis of the cell that would contain a position (m), inside or outside
        the grid."""
        at = ti.Vector.zero(ti.i32, 3)
        for k in ti.static(range(3)):
            at[k] = ti.floor((r[k] - self.low[w, k]) / self.cell[w, level, k], ti.i32)
        return at

    @ti.func
    def dims_of(self, w, level):
        """Return the number of cells of a level along each axis."""
        return ti.Vector([self.dims[w, level, 0], self.dims[w, level, 1], self.dims[w, level, 2]])

    @ti.func
    def skin_along(self, w):
        """Return the skin along each axis (m)."""
        return ti.Vector([self.skin[w, 0], self.skin[w, 1], self.skin[w, 2]])

    @ti.func
    def extent(self, w):
        """Return the sides (m) of the bounding box of the particles; along joined axes, the sides of the
        domain."""
        extent = self.domain.side(w)
        for k in ti.static(range(3)):
            if ti.static(not self.joined[k]):
                extent[k] = self.high[w, k] - self.low[w, k]
        return extent

    @ti.func
    def divide(self, cells, most):
        """Return the number of cells along each axis: ``cells``, scaled down in proportion if the total
        exceeds ``most``."""
        dims = ti.max(1, ti.floor(cells, ti.i32))
        while dims[0] * dims[1] * dims[2] > most:
            cells *= 0.9
            dims = ti.max(1, ti.floor(cells, ti.i32))
        return dims

    @ti.func
    def row(self, w, level, z, y):
        """Return the index of the first cell of a row along x."""
        return self.offset[w, level] + (z * self.dims[w, level, 1] + y) * self.dims[w, level, 0]

    @ti.func
    def cell_index(self, w, level, at):
        """Return the index of a cell, by its index along each axis."""
        return self.row(w, level, at[2], at[1]) + at[0]


@ti.func
def next_number(column: ti.template(), w, k, shared: ti.template()):  # type: ignore[valid-type]
    """Return column[w, k] and increment it; the operation is atomic if several threads share a world."""
    number = 0
    if ti.static(shared):
        number = ti.atomic_add(column[w, k], 1)
    else:
        number = column[w, k]
        column[w, k] = number + 1
    return number


class OfGrid(Phase):
    """Base of the phases that work on the cells of a world."""

    def __init__(self, grid: CellGrid) -> None:
        self.g, self.s = grid, grid.s


class OfParticles(OfGrid):
    """Base of the phases that work on each particle."""

    def __init__(self, grid: CellGrid) -> None:
        super().__init__(grid)
        self.extent = grid.s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class OfBlocks(OfGrid):
    """Base of the phases that work on blocks of particles, each from ``begin`` to ``end``.

    The result of a block is added to its world in one operation, so threads seldom compete.
    """

    def __init__(self, grid: CellGrid) -> None:
        super().__init__(grid)
        self.extent, self.light = -(-grid.s.capacity // grid.block), grid.block == 1

    @ti.func
    def size(self, w):
        return (self.s.count[w] + self.g.block - 1) // self.g.block

    @ti.func
    def begin(self, b):
        """Return the first particle of a block."""
        return b * self.g.block

    @ti.func
    def end(self, w, b):
        """Return the particle after the last of a block."""
        return ti.min((b + 1) * self.g.block, self.s.count[w])


class OfCells(OfGrid):
    """Base of the phases that work on each cell and on the end of the last one."""

    def __init__(self, grid: CellGrid) -> None:
        super().__init__(grid)
        self.extent = grid.max_cells + 1

    @ti.func
    def size(self, w):
        return self.g.total[w] + 1
