"""Sums over listed pairs: each pair is computed once, by its chunk, and added to both particles in a fixed
order.

On a CPU several pairs are computed at once, one per lane, in a loop that compilers can vectorise because its
results have no other readers. The pairs within the interaction range are first moved to the front without
branches: in a list with a skin a CPU cannot predict which pairs these are, and no lane should be idle. If
some laws end at contact and others at a cut-off, each kind is computed for the pairs within its own range.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.pairs.pair_chunks import PairChunks, PerChunk
from tisim.program.evaluation_stage import EvaluationStage
from tisim.program.phases import Item, PerParticle, Phase

if TYPE_CHECKING:
    from tisim.pairs.pair_sum import ListedLaws, PairSum


LANES = 16
"""Pairs computed at once on a CPU (measured: 8 are slower by 3 %)."""


@ti.data_oriented
class ExportedTerms:
    """Exported terms are contributions of pairs of two chunks to the particle in the other chunk, stored
    until its chunk reads them."""

    def __init__(self, pairs: PairChunks, components: int) -> None:
        self.pairs, self.components = pairs, components
        self.columns = tuple(ti.field(pairs.s.real) for _ in range(components))
        builder = Builder()
        builder.dense(ti.i, pairs.s.worlds).dense(ti.j, pairs.pair_capacity).place(*self.columns)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes

    @ti.func
    def write(self, w, m, term):
        for c in ti.static(range(self.components)):
            self.columns[c][w, m] = term[c]

    @ti.func
    def read(self, w, m):
        term = ti.Vector.zero(self.pairs.s.real, self.components)
        for c in ti.static(range(self.components)):
            term[c] = self.columns[c][w, m]
        return term


class PartOfSum(PerChunk):
    """Base of the phases that do a part of a sum, for each chunk."""

    conditional = True

    def __init__(self, total: "PairSum", exported: ExportedTerms) -> None:
        super().__init__(exported.pairs)
        self.total, self.exported = total, exported
        self.listed_only = not total.long_ranged

    @ti.func
    def when(self, w):
        return self.total.when(w)


class ComputePairs(PartOfSum):
    """Base of the phases that compute the pairs of a chunk by some of the laws."""

    def __init__(self, total: "PairSum", exported: ExportedTerms, laws: "ListedLaws") -> None:
        super().__init__(total, exported)
        self.laws, self.lanes = laws, LANES if runtime.current().device == "cpu" else 1

    @ti.func
    def note_memory(self, w):
        """Mark the contact history as newer than the values stored on particles, if this sum updates it."""
        if ti.static(len(self.laws.remembering) > 0) and self.total.updates_memory(w):
            self.p.unsaved[w] = 1

    @ti.func
    def process_pair(self, w, c, m, values):
        """Use the values computed for pair m of chunk c."""

    @ti.func
    def process_distant_pair(self, w, c, m):
        """Handle pair m of chunk c, which is beyond the range of all of these laws."""

    @ti.func
    def compute_pairs(self, w, c):
        """Compute the pairs of a chunk within the interaction range, and process each in list order."""
        p = self.p
        begin, end = p.begin[w, c], p.end[w, c]
        near = self.partition_pairs(w, begin, end)
        if ti.static(self.lanes > 1):
            for block in range((near - begin + self.lanes - 1) // self.lanes):
                self.compute_block(w, c, begin + block * self.lanes, near)
        else:
            # Vectors of one lane in two loops of a kernel do not compile for Vulkan.
            for k in range(begin, near):
                self.process_pair(w, c, p.partitioned[w, k], self.values_of(w, p.partitioned[w, k]))
        for k in range(near, end):
            self.process_distant_pair(w, c, p.partitioned[w, k])

    @ti.func
    def partition_pairs(self, w, begin, end):
        """Put the pairs within range first into ``partitioned``, in list order; return the end of these
        pairs."""
        p, s, t = self.p, self.s, self.s.time[w]
        near, far = begin, end - 1
        for m in range(begin, end):
            i, j = p.first[w, m], p.second[w, m]
            d = self.total.domain.separation(w, s.position[w, i], s.position[w, j], t)
            limit = p.half_list.widest(self.laws.reaching, w, i, j)
            within = ti.cast(d.norm_sqr() <= limit * limit, ti.i32)
            p.partitioned[w, ti.select(within > 0, near, far)] = m
            near, far = near + within, far + within - 1
        return near

    @ti.func
    def values_of(self, w, m):
        """Return the values computed for listed pair m."""
        s, i, j, t = self.s, self.p.first[w, m], self.p.second[w, m], self.s.time[w]
        d = self.total.domain.separation(w, s.position[w, i], s.position[w, j], t)
        return self.total.compute_pair(self.laws, w, m, i, j, d, d.norm(), t)

    @ti.func
    def compute_block(self, w, c, begin, end):
        """Compute one pair per lane, up to ``end``, and process each."""
        p, s = self.p, self.s
        lanes = [ti.Vector([0.0] * self.lanes, s.real) for _ in ti.static(range(self.laws.values))]
        for lane in range(self.lanes):
            # Lanes beyond the last pair compute it again; their results are not read.
            values = self.values_of(w, p.partitioned[w, ti.min(begin + lane, end - 1)])
            for k in ti.static(range(self.laws.values)):
                lanes[k][lane] = values[k]
        for lane in range(ti.min(self.lanes, end - begin)):
            values = ti.Vector.zero(s.real, self.laws.values)
            for k in ti.static(range(self.laws.values)):
                values[k] = lanes[k][lane]
            self.process_pair(w, c, p.partitioned[w, begin + lane], values)


class AddPairs(ComputePairs):
    """This phase computes the pairs of a chunk and adds each to the particles of the pair that are in the
    chunk.

    first : whether these are the first pair terms of the sum.
    """

    def __init__(self, total: "PairSum", exported: ExportedTerms, laws: "ListedLaws", first: bool) -> None:
        super().__init__(total, exported, laws)
        self.first = first

    @ti.func
    def run(self, w, c):
        p, s = self.p, self.s
        self.note_memory(w)
        if ti.static(self.first and self.listed_only):
            for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, s.count[w])):
                self.total.write_sum(w, i, ti.Vector.zero(s.real, self.total.components))
        self.compute_pairs(w, c)

    @ti.func
    def process_pair(self, w, c, m, values):
        p, i, j = self.p, self.p.first[w, m], self.p.second[w, m]
        here, there = self.total.pair_contributions(values)
        self.total.write_memory(self.laws, w, m, values)
        if m < p.outer[w, c]:
            self.total.write_sum(w, i, self.total.combine(self.total.read_sum(w, i), here))
            self.total.write_sum(w, j, self.total.combine(self.total.read_sum(w, j), there))
        elif p.chunk_of(i) == c:
            self.total.write_sum(w, i, self.total.combine(self.total.read_sum(w, i), here))
            self.export(w, m, there)
        else:
            self.total.write_sum(w, j, self.total.combine(self.total.read_sum(w, j), there))
            self.export(w, m, here)

    @ti.func
    def export(self, w, m, term):
        """Store the contribution of pair m to the particle of another chunk."""
        if ti.static(self.first):
            self.exported.write(w, m, term)
        else:
            self.exported.write(w, m, self.total.combine(self.exported.read(w, m), term))

    @ti.func
    def process_distant_pair(self, w, c, m):
        self.total.out_of_reach(self.laws, w, m)
        if ti.static(self.first) and m >= self.p.outer[w, c]:
            self.exported.write(w, m, ti.Vector.zero(self.s.real, self.total.components))


class CloseSum(PartOfSum):
    """This phase adds the terms exported by other chunks to the particles of this one, and finishes the sums.

    after : further phases of the step that run for each particle at once, while it is in the cache.
    """

    def __init__(
        self, total: "PairSum", exported: ExportedTerms, after: tuple[PerParticle, ...] = ()
    ) -> None:
        super().__init__(total, exported)
        self.after = after

    @property
    def name(self) -> str:
        return ", ".join((super().name, *(phase.name for phase in self.after)))

    @ti.func
    def run(self, w, c):
        p, t = self.p, self.s.time[w]
        for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, self.s.count[w])):
            result, begin = self.total.read_sum(w, i), p.fetch_begin[w, i]
            for m in range(begin, begin + p.fetch_count[w, i]):
                result = self.total.combine(result, self.exported.read(w, p.fetched[w, m]))
            if ti.static(self.listed_only):
                result += self.total.start(w, i, t)
            self.total.finish(w, i, result, t)
            # After a failure the state stays unchanged, so that the law at fault can be found.
            if self.s.failed[w] == 0 and self.s.evaluation_stage[w] == EvaluationStage.STEP:
                for phase in ti.static(self.after):
                    phase.run(w, i)


def fuse(step: Sequence[Item], sums: Sequence[Item]) -> tuple[list[Item], list[Item]]:
    """Fuse local phases that follow a sum into the end of that sum.

    Returns the items of the step, and the items of the sums with the same fused ends.
    """
    fused: list[Item] = []
    ends: dict[Item, Item] = {}
    for item in step:
        last = fused[-1] if fused else None
        if isinstance(last, CloseSum) and isinstance(item, PerParticle) and item.local:
            fused[-1] = CloseSum(last.total, last.exported, (*last.after, item))
            ends |= {end: fused[-1] for end in (last, *(key for key in ends if ends[key] is last))}
        else:
            fused.append(item)
    return fused, [ends.get(item, item) for item in sums]


def sum_phases(total: "PairSum", exported: ExportedTerms | None) -> tuple[Phase, ...]:
    """Return the phases of a sum: over all others, then over the listed pairs if there are any."""
    if exported is None or not total.short_ranged:
        return (total,)
    before = (total,) if total.long_ranged else ()
    parts = enumerate(total.listed_laws())
    added = tuple(AddPairs(total, exported, laws, first=k == 0) for k, laws in parts)
    return *before, *added, CloseSum(total, exported)
