"""Phases that rebuild the listed pairs, with their contact history, if the list is due."""

from tisim.backend.taichi import ti
from tisim.pairs.cell_phases import sort_row
from tisim.pairs.half_list import rebuild_half_list, watch_reach
from tisim.pairs.pair_chunks import PairChunks, PerChunk, PerWorld
from tisim.program.phases import Item, Phase, Repeat
from tisim.state.status import WorldStatus


def update_pairs(pairs: PairChunks) -> tuple[Item, ...]:
    """Return the items that rebuild the pairs if the list is due."""
    store = (StoreMemory(pairs),) if pairs.memories else ()
    place = (CountPairs(pairs), *pairs.ends.phases(), PlacePairs(pairs), FillPairs(pairs))
    fetch = (*pairs.fetch_ends.phases(), EnterFetches(pairs), SortFetches(pairs))
    rows = (*store, BeginRebuild(pairs), *rebuild_half_list(pairs.half_list))
    rebuild = RebuildPairs(pairs, (*rows, *place, *fetch, EndRebuild(pairs)))
    return (*watch_reach(pairs.half_list), rebuild)


class RebuildPairs(Repeat):
    """This item rebuilds the pairs of a world once if its list is due."""

    usual = 0

    def __init__(self, pairs: PairChunks, items: tuple[Phase, ...]) -> None:
        super().__init__(items)
        self.p = pairs

    @ti.func
    def pending(self, w):
        return self.p.half_list.stale[w]


class StoreMemory(PerChunk):
    """This phase stores the contact history on the particles unless it is stored already."""

    conditional = True

    @ti.func
    def when(self, w):
        return self.p.unsaved[w]

    @ti.func
    def run(self, w, c):
        self.p.store_chunk(w, c)


class BeginRebuild(PerWorld):
    """This phase marks the contact history as stored on the particles."""

    @ti.func
    def run(self, w, _k):
        self.p.unsaved[w] = 0


class CountPairs(PerChunk):
    """This phase counts the inner and outer pairs of each chunk."""

    @ti.func
    def run(self, w, c):
        p = self.p
        n, inner, outer = p.half_list, 0, 0
        for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, self.s.count[w])):
            p.fetch_count[w, i] = 0
            for k in range(n.size[w, i]):
                within = ti.cast(p.chunk_of(n.index[w, i, k]) == c, ti.i32)
                inner, outer = inner + within, outer + 1 - within
        p.outer[w, c], p.end[w, c] = inner, inner + outer


class PlacePairs(PerChunk):
    """This phase finds the first inner and the first outer pair of each chunk."""

    @ti.func
    def run(self, w, c):
        p = self.p
        if p.ends.total[w] > p.pair_capacity:
            ti.atomic_max(self.s.failed[w], WorldStatus.LIST_OVERFLOW)
            p.begin[w, c], p.outer[w, c], p.end[w, c] = 0, 0, 0
        else:
            begin = 0
            if c > 0:
                begin = p.end[w, c - 1]
            p.begin[w, c], p.outer[w, c] = begin, begin + p.outer[w, c]


class FillPairs(PerChunk):
    """This phase enters the pairs of a chunk, in the order of the particles that list them, with their
    contact history."""

    @ti.func
    def run(self, w, c):
        p, s = self.p, self.s
        n, inner, outer = p.half_list, p.begin[w, c], p.outer[w, c]
        if p.end[w, c] > inner:
            for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, s.count[w])):
                for k in range(n.size[w, i]):
                    j = n.index[w, i, k]
                    within = p.chunk_of(j) == c
                    m = ti.select(within, inner, outer)
                    inner, outer = inner + ti.select(within, 1, 0), outer + ti.select(within, 0, 1)
                    if not within:
                        ti.atomic_add(p.fetch_count[w, j], 1)
                    ordered = s.id[w, i] < s.id[w, j]
                    p.first[w, m], p.second[w, m] = ti.select(ordered, i, j), ti.select(ordered, j, i)
                    for one in ti.static(p.memories):
                        one.recall(w, m, i, j)


class EnterFetches(PerChunk):
    """This phase enters each outer pair with its particle in another chunk, in any order of threads."""

    @ti.func
    def run(self, w, c):
        p = self.p
        for m in range(p.outer[w, c], p.end[w, c]):
            j = ti.select(p.chunk_of(p.first[w, m]) == c, p.second[w, m], p.first[w, m])
            p.fetched[w, ti.atomic_sub(p.fetch_begin[w, j], 1) - 1] = m


class SortFetches(PerChunk):
    """This phase sorts the slots that each particle fetches by their position in the list."""

    @ti.func
    def run(self, w, c):
        p = self.p
        for i in range(c * p.chunk, ti.min((c + 1) * p.chunk, self.s.count[w])):
            begin = p.fetch_begin[w, i]
            sort_row(p.fetched, ti.Vector([w]), begin, begin + p.fetch_count[w, i])


class EndRebuild(PerWorld):
    """This phase marks the list as up to date."""

    @ti.func
    def run(self, w, _k):
        self.p.half_list.stale[w] = 0
