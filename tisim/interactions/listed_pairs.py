"""Sums over listed pairs: each pair is computed once, by its chunk, and reaches both in a fixed order.

On a CPU several pairs are computed at once, one lane each, in a loop whose results have no other readers, so
compilers vectorise it. First the pairs within reach are sorted out, without a branch: which of those that a
list with a skin holds they are no CPU can foresee, and none of the lanes should be idle.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.interactions.pair_chunks import OfChunks, PairChunks
from tisim.worlds.phases import Item, PerParticle, Phase

if TYPE_CHECKING:
    from tisim.interactions.force_sum import SumForces
    from tisim.interactions.pair_sum import PairSum


LANES = 16
"""So many pairs are computed at once on a CPU (measured: 8 are slower by 3 %)."""


@ti.data_oriented
class PairTerms:
    """Pair terms are what pairs of two chunks give to the particle that is not in theirs, until its chunk
    fetches it."""

    def __init__(self, pairs: PairChunks, components: int) -> None:
        self.pairs, self.components = pairs, components
        self.columns = tuple(ti.field(pairs.s.real) for _ in range(components))
        builder = Builder()
        builder.dense(ti.i, pairs.s.worlds).dense(ti.j, pairs.room).place(*self.columns)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes

    @ti.func
    def leave(self, w, m, term):
        for c in ti.static(range(self.components)):
            self.columns[c][w, m] = term[c]

    @ti.func
    def fetch(self, w, m):
        term = ti.Vector.zero(self.pairs.s.real, self.components)
        for c in ti.static(range(self.components)):
            term[c] = self.columns[c][w, m]
        return term


class PartOfSum(OfChunks):
    """This phase does a part of a sum, for each chunk."""

    conditional = True

    def __init__(self, total: "PairSum", left: PairTerms) -> None:
        super().__init__(left.pairs)
        self.total, self.left = total, left
        self.alone = not total.long_ranged
        self.lanes = LANES if runtime.current().device == "cpu" else 1
        self.commits = total.commits and bool(left.pairs.memories)

    @ti.func
    def when(self, w):
        return self.total.when(w)

    @ti.func
    def note_memory(self, w):
        """Note that pairs remember what the particles have not stored, where the sum brings it up to date."""
        if ti.static(self.commits):
            self.p.unsaved[w] = 1

    @ti.func
    def give(self, w, c, m, values):
        """Make use of what pair m of chunk c comes to."""

    @ti.func
    def leave_out(self, w, c, m):
        """Take note that pair m of chunk c is farther apart than any law reaches."""

    @ti.func
    def take_pairs(self, w, c):
        """Compute the pairs of a chunk that are within reach, and give each on, in the order of the list."""
        p = self.p
        begin, end = p.begin[w, c], p.end[w, c]
        near = self.sort_pairs(w, begin, end)
        for block in range((near - begin + self.lanes - 1) // self.lanes):
            self.take_block(w, c, begin + block * self.lanes, near)
        for k in range(near, end):
            self.leave_out(w, c, p.sorted[w, k])

    @ti.func
    def sort_pairs(self, w, begin, end):
        """Put pairs within reach first in ``sorted``, in the order of the list, and return where they end."""
        p, s, t = self.p, self.s, self.s.time[w]
        near, far = begin, end - 1
        for m in range(begin, end):
            i, j = p.first[w, m], p.second[w, m]
            d = self.total.domain.separation(w, s.position[w, i], s.position[w, j], t)
            limit = p.half_list.widest(w, i, j)
            within = ti.cast(d.norm_sqr() <= limit * limit, ti.i32)
            p.sorted[w, ti.select(within > 0, near, far)] = m
            near, far = near + within, far + within - 1
        return near

    @ti.func
    def take_block(self, w, c, begin, end):
        """Compute as many pairs as there are lanes, or as are left before ``end``, and give each on."""
        p, s, t = self.p, self.s, self.s.time[w]
        lanes = [ti.Vector([0.0] * self.lanes, s.real) for _ in ti.static(range(self.total.pair_values))]
        for lane in range(self.lanes):
            # Lanes without a pair of their own compute the last one again, and nobody reads it.
            m = p.sorted[w, ti.min(begin + lane, end - 1)]
            i, j = p.first[w, m], p.second[w, m]
            d = self.total.domain.separation(w, s.position[w, i], s.position[w, j], t)
            values = self.total.of_pair(w, m, i, j, d, d.norm(), t)
            for k in ti.static(range(self.total.pair_values)):
                lanes[k][lane] = values[k]
        for lane in range(ti.min(self.lanes, end - begin)):
            values = ti.Vector.zero(s.real, self.total.pair_values)
            for k in ti.static(range(self.total.pair_values)):
                values[k] = lanes[k][lane]
            self.give(w, c, p.sorted[w, begin + lane], values)


class AddPairs(PartOfSum):
    """This phase computes the pairs of a chunk, and adds each to both particles, or to the one that is in
    it."""

    @ti.func
    def run(self, w, c):
        p, s = self.p, self.s
        self.note_memory(w)
        if ti.static(self.alone):
            for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, s.count[w])):
                self.total.put(w, i, ti.Vector.zero(s.real, self.total.components))
        self.take_pairs(w, c)

    @ti.func
    def give(self, w, c, m, values):
        p, i, j = self.p, self.p.first[w, m], self.p.second[w, m]
        here, there = self.total.shares(values)
        self.total.keep(w, m, values)
        if m < p.outer[w, c]:
            self.total.put(w, i, self.total.get(w, i) + here)
            self.total.put(w, j, self.total.get(w, j) + there)
        elif p.chunk_of(i) == c:
            self.total.put(w, i, self.total.get(w, i) + here)
            self.left.leave(w, m, there)
        else:
            self.total.put(w, j, self.total.get(w, j) + there)
            self.left.leave(w, m, here)

    @ti.func
    def leave_out(self, w, c, m):
        self.total.out_of_reach(w, m)
        if m >= self.p.outer[w, c]:
            self.left.leave(w, m, ti.Vector.zero(self.s.real, self.total.components))


class CloseSum(PartOfSum):
    """This phase adds what other chunks have left for the particles of this one; then the sums are done.

    after : what follows with each particle at once, while it is in the cache.
    """

    def __init__(self, total: "PairSum", left: PairTerms, after: tuple[PerParticle, ...] = ()) -> None:
        super().__init__(total, left)
        self.after = after

    @property
    def name(self) -> str:
        return ", ".join((super().name, *(phase.name for phase in self.after)))

    @ti.func
    def run(self, w, c):
        p, t = self.p, self.s.time[w]
        for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, self.s.count[w])):
            result, begin = self.total.get(w, i), p.fetch_begin[w, i]
            for m in range(begin, begin + p.fetch_count[w, i]):
                result += self.left.fetch(w, p.fetched[w, m])
            if ti.static(self.alone):
                result += self.total.start(w, i, t)
            self.total.finish(w, i, result, t)
            # What has failed stays as it was, so that the law at fault can be found.
            if self.s.failed[w] == 0:
                for phase in ti.static(self.after):
                    phase.run(w, i)


def fuse(items: Sequence[Item]) -> list[Item]:
    """Return the items of a step, in which what is local follows the end of a sum at once."""
    fused: list[Item] = []
    for item in items:
        last = fused[-1] if fused else None
        if isinstance(last, CloseSum) and isinstance(item, PerParticle) and item.local:
            fused[-1] = CloseSum(last.total, last.left, (*last.after, item))
        else:
            fused.append(item)
    return fused


def sum_phases(total: "PairSum", left: PairTerms | None) -> tuple[Phase, ...]:
    """Return the phases of a sum: over all others, and over the pairs that are listed, where there are
    any."""
    if left is None or not total.short_ranged:
        return (total,)
    before = (total,) if total.long_ranged else ()
    return *before, AddPairs(total, left), CloseSum(total, left)


class AdvanceParticles(PerParticle):
    """This phase brings what particles remember by themselves up to date with the end of a step found by
    trial."""

    def __init__(self, total: "SumForces") -> None:
        super().__init__(total.s)
        self.total = total

    @ti.func
    def run(self, w, i):
        self.total.singles(w, i, self.s.time[w])


class AdvancePairs(PartOfSum):
    """This phase brings what pairs remember up to date with the end of a step that was found by trial."""

    @ti.func
    def run(self, w, c):
        self.note_memory(w)
        self.take_pairs(w, c)

    @ti.func
    def give(self, w, c, m, values):
        self.total.keep(w, m, values)

    @ti.func
    def leave_out(self, w, c, m):
        self.total.out_of_reach(w, m)
