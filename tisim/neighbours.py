"""Pairs whose surfaces are near: all pairs for small worlds, a cell list with a skin for larger ones.

Each pair is listed once, by its larger member (of equals, the lower index). A particle then searches only
as far as twice its own radius, so a few large grains among many small ones cost no more than their volume.
A list is made anew when particles have moved, relative to the world's own frame, so far that a pair it
lacks could matter. What is done with a pair depends on its true distance, never on whether the list was
due: results do not depend on when lists were made, and a restarted run keeps its bits.
"""

from __future__ import annotations

from tisim._taichi import ti
from tisim.domain import Domain
from tisim.effect import PairForce
from tisim.program import PerParticle, Phase
from tisim.state import NOT_FINITE, State

SMALL = 48
"""Worlds of at most this many particles look at all pairs."""
LISTED = 24
"""Neighbours a particle can list; one with more looks at all particles."""
HORIZON = 0.15
"""Gap within which every pair is sure to be offered, in mean distances between particles."""
AHEAD = 2.0
"""Steps that a list is meant to last: its skin along each axis is what particles move in them."""
CELLS_PER_PARTICLE = 2


@ti.data_oriented
class Neighbours:
    """The pair list of every world."""

    def __init__(self, s: State, domain: Domain, short_ranged: tuple[PairForce, ...] = ()) -> None:
        self.short_ranged = short_ranged
        self.s, self.domain, self.joined = s, domain, domain.joined()
        worlds, capacity = s.worlds, s.capacity
        self.max_cells = CELLS_PER_PARTICLE * capacity + 8
        builder = ti.FieldsBuilder()
        self.cell_start, self.cell_of, self.order, self.listed = (ti.field(ti.i32) for _ in range(4))
        self.other = ti.field(ti.i32)
        self.dims = ti.Vector.field(3, ti.i32)
        self.corner, self.cell = ti.Vector.field(3, s.real), ti.Vector.field(3, s.real)
        self.sorted_position, self.sorted_radius = ti.Vector.field(3, s.real), ti.field(s.real)
        self.skin = ti.Vector.field(3, s.real)
        self.gap = ti.field(s.real)
        self.stale = ti.field(ti.i32)
        builder.dense(ti.i, worlds).dense(ti.j, self.max_cells + 1).place(self.cell_start)
        for column in (self.cell_of, self.order, self.listed, self.sorted_position, self.sorted_radius):
            builder.dense(ti.i, worlds).dense(ti.j, capacity).place(column)
        builder.dense(ti.i, worlds).dense(ti.j, capacity).dense(ti.k, LISTED).place(self.other)
        for column in (self.dims, self.corner, self.cell, self.skin, self.gap, self.stale):
            builder.dense(ti.i, worlds).place(column)
        self._tree = builder.finalize()

    def phases(self) -> tuple[Phase, ...]:
        """Bring the list up to date where it is due."""
        return (Bin(self), Search(self), Listed(self))

    def bytes(self) -> int:
        """Device memory, in bytes."""
        real = 8 if self.s.real == ti.f64 else 4
        per_world = 4 * (self.max_cells + 5 + self.s.capacity * (3 + LISTED))
        return self.s.worlds * (per_world + real * (10 + 4 * self.s.capacity))

    def destroy(self) -> None:
        """Give the memory back."""
        self._tree.destroy()

    @ti.func
    def owns(self, w, i, j):
        """Whether the pair is i's to list."""
        a, b = self.s.radius[w, i], self.s.radius[w, j]
        return a > b or (a == b and i < j)

    @ti.func
    def size(self, w, i):
        """How many candidates ``candidate`` offers particle i."""
        n = self.s.count[w]
        if n > SMALL and self.listed[w, i] >= 0:
            n = self.listed[w, i]
        return n

    @ti.func
    def candidate(self, w, i, k):
        """The k-th particle that may be a neighbour owned by i; i itself where there is none."""
        j = k
        if self.s.count[w] > SMALL and self.listed[w, i] >= 0:
            j = self.other[w, i, k]
        elif not self.owns(w, i, k):
            j = i
        return j

    @ti.func
    def spacing(self, w):
        """Mean distance between particles: the cube root of the volume at the start for each. m."""
        return ti.cast(ti.pow(self.s.volume[w] / self.s.count[w], 1.0 / 3.0), self.s.real)

    @ti.func
    def horizon(self, w):
        """Gap between surfaces (m) within which every pair is sure to be offered."""
        return HORIZON * self.spacing(w)

    @ti.func
    def sure(self, w):
        """The same where only near pairs are offered; 0, for no limit, where all pairs are. m."""
        return ti.select(self.s.count[w] > SMALL, self.horizon(w), 0.0)

    @ti.func
    def moved(self, w):
        """Note that particles have moved by at most ``stride`` relative to the frame, along each axis."""
        for k in ti.static(range(3)):
            self.s.travel[w, k] += self.s.stride[w, k]
            if 2.0 * self.s.travel[w, k] > self.skin[w][k]:
                self.stale[w] = 1

    @ti.func
    def place(self, w, r):
        """Index of the cell along each axis."""
        c = ti.floor((r - self.corner[w]) / self.cell[w], ti.i32)
        return ti.max(0, ti.min(c, self.dims[w] - 1))

    @ti.func
    def around(self, c, cells):
        """Index of a cell that may lie across a joined face, by less than one turn."""
        return c + ti.select(c < 0, cells, 0) - ti.select(c >= cells, cells, 0)

    @ti.func
    def turns(self, c, cells):
        """Which image of the box a cell lies in, along each axis: -1, 0 or 1."""
        return ti.select(c >= cells, 1, 0) - ti.select(c < 0, 1, 0)


class Bin(Phase):
    """Sort the particles of a world into cells, serially, so that the order in a cell is that of indices."""

    conditional = True

    def __init__(self, neighbours: Neighbours) -> None:
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w] > 0 and self.n.s.count[w] > SMALL

    @ti.func
    def run(self, w, _k):
        n, s = self.n, self.n.s
        count = s.count[w]
        low, high, least = s.position[w, 0], s.position[w, 0], s.radius[w, 0]
        for i in range(count):
            low, high = ti.min(low, s.position[w, i]), ti.max(high, s.position[w, i])
            least = ti.min(least, s.radius[w, i])
            # Not below infinity: also true of NaN, which belongs to no cell.
            if not (ti.abs(s.position[w, i]).sum() + s.radius[w, i] < ti.math.inf):
                s.fail(w, NOT_FINITE, i)
        if ti.static(n.joined):
            low = n.domain.origin(w)
            high = low + n.domain.side(w)
        extent = ti.max(high - low, 1e-3 * least)
        spacing = ti.pow(extent[0] * extent[1] * extent[2] / count, 1.0 / 3.0)
        n.skin[w] = ti.min(2.0 * AHEAD * ti.cast(s.axes(s.stride, w), s.real), spacing)
        n.gap[w] = n.horizon(w)
        for effect in ti.static(n.short_ranged):
            n.gap[w] = ti.max(n.gap[w], effect.reach(w))
        width = ti.max(spacing, 2.0 * least + n.gap[w])
        dims = ti.max(1, ti.floor(ti.min(extent / width, 1e3), ti.i32))
        while dims[0] * dims[1] * dims[2] > n.max_cells:
            dims = (dims + 1) // 2
        n.dims[w], n.corner[w], n.cell[w] = dims, low, extent / dims
        cells = dims[0] * dims[1] * dims[2]
        for c in range(cells + 1):
            n.cell_start[w, c] = 0
        for i in range(count):
            c = n.place(w, s.position[w, i])
            flat = (c[2] * dims[1] + c[1]) * dims[0] + c[0]
            n.cell_of[w, i] = flat
            n.cell_start[w, flat] += 1
        total = 0
        for c in range(cells + 1):
            total += n.cell_start[w, c]
            n.cell_start[w, c] = total
        for back in range(count):
            i = count - 1 - back
            c = n.cell_of[w, i]
            n.cell_start[w, c] -= 1
            m = n.cell_start[w, c]
            n.order[w, m] = i
            n.sorted_position[w, m], n.sorted_radius[w, m] = s.position[w, i], s.radius[w, i]


class Search(PerParticle):
    """Let each particle list the smaller ones near it."""

    conditional = True

    def __init__(self, neighbours: Neighbours) -> None:
        super().__init__(neighbours.s)
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w]

    @ti.func
    def run(self, w, i):
        n, s = self.n, self.s
        if s.count[w] > SMALL:
            # Copies: the compiler cannot know that writing a list does not change what it reads.
            r, radius, dims, skin = s.position[w, i], s.radius[w, i], n.dims[w], n.skin[w]
            side = n.domain.side(w)
            near = radius + n.gap[w]
            reach = near + radius + skin
            first = ti.floor((r - reach - n.corner[w]) / n.cell[w], ti.i32)
            last = ti.floor((r + reach - n.corner[w]) / n.cell[w], ti.i32)
            found = 0
            if ti.static(n.joined):
                # What reaches around the box may meet one image or another: it looks at all.
                found = ti.select((last - first >= dims).any(), LISTED + 1, 0)
            else:
                first, last = ti.max(first, 0), ti.min(last, dims - 1)
            z = first[2]
            while z <= last[2] and found <= LISTED:
                for y in range(first[1], last[1] + 1):
                    row = (n.around(z, dims[2]) * dims[1] + n.around(y, dims[1])) * dims[0]
                    # Cells of a row follow each other in memory; across a joined face it is two stretches.
                    x = first[0]
                    while x <= last[0]:
                        begin = n.around(x, dims[0])
                        end = ti.min(begin + last[0] - x, dims[0] - 1)
                        here = r - n.turns(ti.Vector([x, y, z]), dims) * side
                        for m in range(n.cell_start[w, row + begin], n.cell_start[w, row + end + 1]):
                            d = ti.max(ti.abs(n.sorted_position[w, m] - here) - skin, 0.0)
                            limit = near + n.sorted_radius[w, m]
                            if d.norm_sqr() <= limit * limit:
                                j = n.order[w, m]
                                if n.owns(w, i, j):
                                    if found < LISTED:
                                        n.other[w, i, found] = j
                                    found += 1
                        x += end - begin + 1
                z += 1
            n.listed[w, i] = found if found <= LISTED else -1


class Listed(Phase):
    """Declare the list fresh, once every particle has searched."""

    conditional = True

    def __init__(self, neighbours: Neighbours) -> None:
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w]

    @ti.func
    def run(self, w, _k):
        self.n.stale[w] = 0
        for k in ti.static(range(3)):
            self.n.s.travel[w, k] = 0.0
