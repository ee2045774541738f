"""The listed pairs, arranged so that each is computed once and every sum has one fixed order.

Particles are divided into chunks of a fixed number of slots, and each chunk is the work of one thread. The
pairs of a chunk are contiguous: first the inner pairs, then the pairs that one of its particles lists with a
particle of another chunk. The thread adds an inner pair to both particles. For an outer pair it adds one side
and stores the other in the slot of the pair, from which the chunk of the other particle fetches it. Every sum
therefore has a single writer and an order that depends only on particle indices, with bitwise equal results
on one thread and on many.

The contact history is stored with the pairs. Before indices change or a list is rebuilt, it is stored on the
particles, under the id of the partner, and a new list reads it from there.
"""

from typing import TYPE_CHECKING

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.pairs.half_list import HalfList
from tisim.program.phases import PerParticle, Phase
from tisim.program.scans import PrefixSum

if TYPE_CHECKING:
    from tisim.pairs.contact_memory import ContactMemory

CHUNK_SLOTS = 512
"""Slots of a chunk on a CPU, chosen so that the state of its particles fits in the nearest cache; 1 on a
GPU."""


@ti.data_oriented
class PairChunks:
    """Pair chunks hold the pairs of every world: particles ``first[w, m]`` and ``second[w, m]``, the one of
    lower id first.

    The inner pairs of chunk c run from ``begin[w, c]`` to ``outer[w, c]``, and its outer pairs from there to
    ``end[w, c]``. ``partitioned`` holds the same pairs in the order of a sum: pairs within the interaction
    range come first. Particle i fetches the pair slots ``fetched[w, m]`` for m from ``fetch_begin[w, i]`` on.

    ``unsaved[w]`` says whether the contact history is newer than the values stored on the particles; sums
    that update the history set it. A list made for a trial state may lack pairs of the last good state; their
    history stays stored on the particles.
    """

    def __init__(self, half_list: HalfList, memories: tuple["ContactMemory", ...]) -> None:
        self.half_list, self.s = half_list, half_list.s
        s = self.s
        self.memories = memories
        self.chunk = CHUNK_SLOTS if runtime.current().device == "cpu" else 1
        self.chunks = -(-s.capacity // self.chunk)
        self.pair_capacity = half_list.sizes.mean * s.capacity
        self.first, self.second, self.partitioned, self.fetched, self.fetch_begin, self.fetch_count = (
            ti.field(ti.i32) for _ in range(6)
        )
        self.begin, self.outer, self.end, self.unsaved = (ti.field(ti.i32) for _ in range(4))
        builder = Builder()
        # A pair and its history are one record, because they are read together.
        records = (self.first, self.second, *(value for one in memories for value in one.make_fields()))
        builder.dense(ti.i, s.worlds).dense(ti.j, self.pair_capacity).place(*records)
        for column in (self.partitioned, self.fetched):
            builder.dense(ti.i, s.worlds).dense(ti.j, self.pair_capacity).place(column)
        for column in (self.fetch_begin, self.fetch_count):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(column)
        for column in (self.begin, self.outer, self.end):
            builder.dense(ti.i, s.worlds).dense(ti.j, self.chunks).place(column)
        builder.dense(ti.i, s.worlds).place(self.unsaved)
        self.tree = Tree(builder)
        # Ends of the pairs of each chunk, and of the slots that each particle fetches.
        self.ends = PrefixSum(s, PerChunk(self), self.end, self.end)
        self.fetch_ends = PrefixSum(s, PerParticle(s), self.fetch_count, self.fetch_begin)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.ends.bytes() + self.fetch_ends.bytes() + self.half_list.bytes()

    @in_taichi_thread
    def forget(self) -> None:
        """Have every list rebuilt before its next use; the stored history of the particles is up to date."""
        self.half_list.forget()
        self.unsaved.fill(0)

    @ti.func
    def moved(self, w):
        """Record how far particles have moved in a step."""
        self.half_list.moved(w)

    @ti.func
    def chunk_of(self, i):
        """Return the chunk that particle i belongs to."""
        return i // self.chunk

    @in_taichi_thread
    def store_memory(self) -> None:
        """Store the contact history on the particles, so that their fields can be read."""
        if self.memories:
            self._store_all()

    @ti.kernel
    def _store_all(self):
        for w, c in ti.ndrange(self.s.worlds, self.chunks):
            if self.unsaved[w] > 0 and c * self.chunk < self.s.count[w]:
                self.store_chunk(w, c)

    @ti.func
    def store_chunk(self, w, c):
        s = self.s
        for i in range(c * self.chunk, ti.min((c + 1) * self.chunk, s.count[w])):
            for one in ti.static(self.memories):
                one.clear(w, i)
        for m in range(self.begin[w, c], self.end[w, c]):
            i, j = self.first[w, m], self.second[w, m]
            # Within a chunk either particle may store the history; otherwise the particle of this chunk does.
            owner, other = i, j
            if self.chunk_of(i) != c or (m < self.outer[w, c] and self.half_list.lists(w, j, i)):
                owner, other = j, i
            for one in ti.static(self.memories):
                one.store(w, m, owner, other)

    @ti.func
    def invalidate(self, w):
        """Have the list rebuilt; particles have been moved other than by a step, and their stored history is
        up to date."""
        self.half_list.stale[w], self.unsaved[w] = 1, 0


class PerWorld(Phase):
    """Base of the phases that work on the pairs of a world."""

    def __init__(self, pairs: PairChunks) -> None:
        self.p, self.s = pairs, pairs.s


class PerChunk(PerWorld):
    """Base of the phases that work on the pairs of each chunk."""

    light = False

    def __init__(self, pairs: PairChunks) -> None:
        super().__init__(pairs)
        self.extent = pairs.chunks

    @ti.func
    def size(self, w):
        return (self.s.count[w] + self.p.chunk - 1) // self.p.chunk
