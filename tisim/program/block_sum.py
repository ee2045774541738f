"""Sums over the particles of a world: by blocks, then over the blocks, so always in the same order."""

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.state import State

BLOCK = 64
"""A block has so many particles."""


@ti.data_oriented
class BlockSums:
    """BlockSums hold the sums over each block, ``terms`` of them side by side; f64."""

    def __init__(self, s: State, terms: int) -> None:
        self.s, self.terms = s, terms
        self.blocks = -(-s.capacity // BLOCK)
        self.partial = ti.Vector.field(terms, ti.f64)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, self.blocks).place(self.partial)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory that the sums take, in bytes."""
        return self.tree.bytes

    @ti.func
    def number(self, w):
        """Return the number of blocks in use."""
        return (self.s.count[w] + BLOCK - 1) // BLOCK

    @ti.func
    def total(self, w):
        """Return the sums over all blocks."""
        total = ti.Vector.zero(ti.f64, self.terms)
        for b in range(self.number(w)):
            total += self.partial[w, b]
        return total


class PerBlock(Phase):
    """This phase is a loop over blocks of particles that also sums ``each(w, i)`` over them."""

    def __init__(self, sums: BlockSums) -> None:
        self.s, self.sums, self.extent = sums.s, sums, sums.blocks

    @ti.func
    def size(self, w):
        return self.sums.number(w)

    @ti.func
    def each(self, w, i):
        """Work on particle i, and return its terms of the sums; f64."""
        return ti.Vector.zero(ti.f64, self.sums.terms)

    @ti.func
    def run(self, w, b):
        total = ti.Vector.zero(ti.f64, self.sums.terms)
        for i in range(b * BLOCK, ti.min((b + 1) * BLOCK, self.s.count[w])):
            total += self.each(w, i)
        self.sums.partial[w, b] = total
