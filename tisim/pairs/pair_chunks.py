"""The listed pairs, laid out so that each is computed once and the sums have one order.

Particles are taken in chunks of a fixed number of slots. The pairs of a chunk follow each other: first those
within it, then those that one of its particles lists with a particle of another chunk. A chunk is the work of
one thread. It adds a pair within it to both particles; of another it adds one side, and leaves the other in
the slot of the pair, where the chunk of that particle fetches it. So every sum has one writer, and an order
that depends on the indices of particles alone: the same bits on one thread and on many.

What touching pairs remember lies with them. Before indices move, or a list is made anew, it is stored with
the particles, under the id of the other, from where a new list recalls it.
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
"""A chunk has this many slots on a CPU: the state of so many particles stays in the nearest cache. On a GPU
it has one."""


@ti.data_oriented
class PairChunks:
    """Pair chunks hold the pairs of every world: particles ``first[w, m]`` and ``second[w, m]``, the one of
    lower id first.

    Chunk c has its inner pairs from ``begin[w, c]`` to ``outer[w, c]``, and the others up to ``end[w, c]``.
    ``partitioned`` has room for the same slots in the order of a sum: those of pairs within reach come first.
    Particle i fetches ``fetched[w, m]``, slots of pairs, for m from ``fetch_begin[w, i]`` on. ``unsaved[w]``
    says whether pairs remember what the particles have not stored: sums that bring memory up to date set it.
    A list that is made for a trial state may lack pairs of the last good one, whose memory stays stored.
    """

    def __init__(self, half_list: HalfList, memories: tuple["ContactMemory", ...]) -> None:
        self.half_list, self.s = half_list, half_list.s
        s = self.s
        self.memories = memories
        self.chunk = CHUNK_SLOTS if runtime.current().device == "cpu" else 1
        self.chunks = -(-s.capacity // self.chunk)
        self.room = half_list.sizes.mean * s.capacity
        self.first, self.second, self.partitioned, self.fetched, self.fetch_begin, self.fetch_count = (
            ti.field(ti.i32) for _ in range(6)
        )
        self.begin, self.outer, self.end, self.unsaved = (ti.field(ti.i32) for _ in range(4))
        builder = Builder()
        # A pair and its memory are one record: they are read together.
        records = (self.first, self.second, *(value for one in memories for value in one.make_fields()))
        builder.dense(ti.i, s.worlds).dense(ti.j, self.room).place(*records)
        for column in (self.partitioned, self.fetched):
            builder.dense(ti.i, s.worlds).dense(ti.j, self.room).place(column)
        for column in (self.fetch_begin, self.fetch_count):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(column)
        for column in (self.begin, self.outer, self.end):
            builder.dense(ti.i, s.worlds).dense(ti.j, self.chunks).place(column)
        builder.dense(ti.i, s.worlds).place(self.unsaved)
        self.tree = Tree(builder)
        # Where the pairs of each chunk end, and where those that each particle fetches do.
        self.ends = PrefixSum(s, PerChunk(self), self.end, self.end)
        self.fetch_ends = PrefixSum(s, PerParticle(s), self.fetch_count, self.fetch_begin)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.ends.bytes() + self.fetch_ends.bytes() + self.half_list.bytes()

    @in_taichi_thread
    def forget(self) -> None:
        """Have every list made anew before it is used again; particles know what they have stored."""
        self.half_list.forget()
        self.unsaved.fill(0)

    @ti.func
    def moved(self, w):
        """Note how far particles have moved in a step."""
        self.half_list.moved(w)

    @ti.func
    def chunk_of(self, i):
        """Return the chunk that particle i belongs to."""
        return i // self.chunk

    @in_taichi_thread
    def store_memory(self) -> None:
        """Store what pairs remember with the particles, so that these can be read."""
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
            # Within a chunk either may store it; else the one whose chunk this is.
            owner, other = i, j
            if self.chunk_of(i) != c or (m < self.outer[w, c] and self.half_list.lists(w, j, i)):
                owner, other = j, i
            for one in ti.static(self.memories):
                one.store(w, m, owner, other)

    @ti.func
    def invalidate(self, w):
        """Have the list made anew; particles have been put elsewhere, and know what they have stored."""
        self.half_list.stale[w], self.unsaved[w] = 1, 0


class PerWorld(Phase):
    """This phase works on the pairs of a world."""

    def __init__(self, pairs: PairChunks) -> None:
        self.p, self.s = pairs, pairs.s


class PerChunk(PerWorld):
    """This phase works on the pairs of each chunk."""

    light = False

    def __init__(self, pairs: PairChunks) -> None:
        super().__init__(pairs)
        self.extent = pairs.chunks

    @ti.func
    def size(self, w):
        return (self.s.count[w] + self.p.chunk - 1) // self.p.chunk
