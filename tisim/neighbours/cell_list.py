"""Make pair lists anew: particles are sorted into cells, and each looks through the cells around it."""

from tisim.backend.taichi import ti
from tisim.neighbours.pair_list import NeighbourList
from tisim.numerics import elementary
from tisim.numerics.ieee import finite
from tisim.worlds.phases import PerParticle, Phase
from tisim.worlds.status import WorldStatus


def list_phases(neighbours: NeighbourList) -> tuple[Phase, ...]:
    """Return the phases that bring the list up to date where it is due."""
    return (BinParticles(neighbours), SearchCells(neighbours), DeclareFresh(neighbours))


class BinParticles(Phase):
    """This phase sorts the particles of a world into cells, serially, so that the order in a cell is that of
    indices."""

    conditional = True

    def __init__(self, neighbours: NeighbourList) -> None:
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w] > 0 and self.n.s.count[w] > self.n.s.listed_above[w]

    @ti.func
    def run(self, w, _k):
        n, s = self.n, self.n.s
        count = s.count[w]
        low, high, smallest = s.position[w, 0], s.position[w, 0], 0
        for i in range(count):
            low, high = ti.min(low, s.position[w, i]), ti.max(high, s.position[w, i])
            smallest = ti.select(s.radius[w, i] < s.radius[w, smallest], i, smallest)
            # What is not finite belongs to no cell.
            if not finite(ti.abs(s.position[w, i]).sum() + s.radius[w, i]):
                s.fail(w, WorldStatus.NOT_FINITE, i)
        corner, side = n.domain.origin(w), n.domain.side(w)
        for k in ti.static(range(3)):
            if ti.static(n.joined[k]):
                low[k], high[k] = corner[k], corner[k] + side[k]
        least = s.radius[w, smallest]
        extent = ti.max(high - low, 1e-3 * least)
        # Root by root: in f32 a volume of 7000 million km cubed is infinite.
        spacing = ti.cast(1.0, s.real)
        for k in ti.static(range(3)):
            spacing *= elementary.pow(extent[k], 1.0 / 3.0)
        spacing /= elementary.pow(ti.cast(count, s.real), 1.0 / 3.0)
        n.skin[w] = ti.min(2.0 * n.ahead * ti.cast(s.axes(s.displacement, w), s.real), spacing)
        n.gap[w] = n.horizon(w)
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
            n.cell_start[w, flat] = n.cell_start[w, flat] + 1
        total = 0
        for c in range(cells + 1):
            total += n.cell_start[w, c]
            n.cell_start[w, c] = total
        for back in range(count):
            i = count - 1 - back
            c = n.cell_of[w, i]
            n.cell_start[w, c] = n.cell_start[w, c] - 1
            m = n.cell_start[w, c]
            n.order[w, m] = i
            n.sorted_position[w, m], n.sorted_radius[w, m] = s.position[w, i], s.radius[w, i]


class SearchCells(PerParticle):
    """This phase lets each particle list the smaller ones near it."""

    conditional = True

    def __init__(self, neighbours: NeighbourList) -> None:
        super().__init__(neighbours.s)
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w]

    @ti.func
    def run(self, w, i):
        n, s = self.n, self.s
        if s.count[w] > s.listed_above[w]:
            # Copies: the compiler cannot know that writing a list does not change what it reads.
            r, radius, dims, skin = s.position[w, i], s.radius[w, i], n.dims[w], n.skin[w]
            side = n.domain.side(w)
            near = radius + n.gap[w]
            reach = near + radius + skin
            first = ti.floor((r - reach - n.corner[w]) / n.cell[w], ti.i32)
            last = ti.floor((r + reach - n.corner[w]) / n.cell[w], ti.i32)
            count = 0
            for k in ti.static(range(3)):
                if ti.static(n.joined[k]):
                    # What reaches around the box may meet one image or another: it looks at all.
                    count = ti.select(last[k] - first[k] >= dims[k], n.room + 1, count)
                else:
                    first[k], last[k] = ti.max(first[k], 0), ti.min(last[k], dims[k] - 1)
            z = first[2]
            while z <= last[2] and count <= n.room:
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
                            size, j = n.sorted_radius[w, m], n.order[w, m]
                            limit = near + size
                            mine = (radius > size) | ((radius == size) & (i < j))
                            # Written whether it counts or not: a branch that cannot be foreseen costs more.
                            n.neighbour_index[w, i, ti.min(count, n.room)] = j
                            count += ti.select(mine & (d.norm_sqr() <= limit * limit), 1, 0)
                        x += end - begin + 1
                z += 1
            n.neighbour_count[w, i] = count if count <= n.room else -1


class DeclareFresh(Phase):
    """This phase declares the list fresh, once every particle has searched."""

    conditional = True

    def __init__(self, neighbours: NeighbourList) -> None:
        self.n = neighbours

    @ti.func
    def when(self, w):
        return self.n.stale[w]

    @ti.func
    def run(self, w, _k):
        self.n.stale[w] = 0
        for k in ti.static(range(3)):
            self.n.s.displacement_since_list[w, k] = 0.0
