"""Sums over listed pairs: each pair is computed once, by its chunk, and reaches both in a fixed order."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.interactions.pair_chunks import OfChunks, PairChunks
from tisim.worlds.program import Item, PerParticle, Phase

if TYPE_CHECKING:
    from tisim.interactions.force_sum import SumForces
    from tisim.interactions.pair_sum import PairSum


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
        s = self.pairs.s
        return s.worlds * self.pairs.room * self.components * (8 if s.real == ti.f64 else 4)

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
        self.commits = total.commits and bool(left.pairs.memories)

    @ti.func
    def when(self, w):
        return self.total.when(w)

    @ti.func
    def note_memory(self, w):
        """Note that pairs remember what the particles have not stored, where the sum brings it up to date."""
        if ti.static(self.commits):
            self.p.unsaved[w] = 1


class AddPairs(PartOfSum):
    """This phase computes the pairs of a chunk, and adds each to both particles, or to the one that is in
    it."""

    @ti.func
    def run(self, w, c):
        p, s, t = self.p, self.s, self.s.time[w]
        outer = p.outer[w, c]
        self.note_memory(w)
        if ti.static(self.alone):
            for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, s.count[w])):
                self.total.put(w, i, ti.Vector.zero(s.real, self.total.components))
        for m in range(p.begin[w, c], p.end[w, c]):
            i, j = p.first[w, m], p.second[w, m]
            d = self.total.domain.separation(w, s.position[w, i], s.position[w, j])
            square, limit = d.norm_sqr(), p.half_list.widest(w, i, j)
            if square <= limit * limit:
                here, there = self.total.terms_of_pair(w, m, i, j, d, ti.sqrt(square), t)
                if m < outer:
                    self.total.put(w, i, self.total.get(w, i) + here)
                    self.total.put(w, j, self.total.get(w, j) + there)
                elif p.chunk_of(i) == c:
                    self.total.put(w, i, self.total.get(w, i) + here)
                    self.left.leave(w, m, there)
                else:
                    self.total.put(w, j, self.total.get(w, j) + there)
                    self.left.leave(w, m, here)
            else:
                self.total.out_of_reach(w, m)
                if m >= outer:
                    self.left.leave(w, m, ti.Vector.zero(s.real, self.total.components))


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

    def __init__(self, total: "SumForces", left: PairTerms) -> None:
        super().__init__(total, left)
        self.laws = tuple(law for law in total.short_ranged if law.data.memory)

    @ti.func
    def run(self, w, c):
        p, s, t = self.p, self.s, self.s.time[w]
        self.note_memory(w)
        for m in range(p.begin[w, c], p.end[w, c]):
            i, j = p.first[w, m], p.second[w, m]
            d = self.total.domain.separation(w, s.position[w, i], s.position[w, j])
            square, limit = d.norm_sqr(), p.half_list.widest(w, i, j)
            if square <= limit * limit:
                for law in ti.static(self.laws):
                    self.total.interaction(law, w, m, i, j, d, ti.sqrt(square), t)
            else:
                self.total.out_of_reach(w, m)
