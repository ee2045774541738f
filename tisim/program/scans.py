"""Prefix sums over items and block sums over the particles of a world.

Sums are taken within blocks, then over the blocks. No loop is as long as a world, and the order is always the
same.
"""

from math import isqrt
from typing import Any

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.state import State

LEAST_BLOCK = {"cpu": 4096}
"""Least number of items of a block; 64 on other devices. Blocks are longer if a world would otherwise have
more blocks than a block has items."""


@ti.data_oriented
class PrefixSum:
    """A prefix sum sets ``target[w, k]`` to ``source[w, 0] + ... + source[w, k]``, integers, for each item k.

    items : a phase of the same extent and size. source, target : the columns, which may be the same one.
    total : ``total[w]`` is the sum of all items.
    """

    def __init__(self, s: State, items: Phase, source: Any, target: Any) -> None:
        self.s, self.items, self.source, self.target = s, items, source, target
        least = LEAST_BLOCK.get(runtime.current().device, 64)
        self.block = max(least, isqrt(items.extent - 1) + 1)
        self.blocks = -(-items.extent // self.block)
        self.before, self.total = ti.field(ti.i32), ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, self.blocks).place(self.before)
        builder.dense(ti.i, s.worlds).place(self.total)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory of the block sums, in bytes."""
        return self.tree.bytes

    def phases(self) -> tuple[Phase, ...]:
        """Return the phases of the sums; a single block needs only one phase."""
        if self.blocks == 1:
            return (SumAll(self),)
        return SumBlocks(self), SumOverBlocks(self), AddToBlocks(self)

    @ti.func
    def number(self, w):
        """Return the number of blocks in use."""
        return (self.items.size(w) + self.block - 1) // self.block


class SumAll(Phase):
    """This phase computes the sums if all items are in one block."""

    def __init__(self, sums: PrefixSum) -> None:
        self.sums = sums

    @ti.func
    def run(self, w, _k):
        p, total = self.sums, 0
        for k in range(p.items.size(w)):
            total += p.source[w, k]
            p.target[w, k] = total
        p.total[w] = total


class SumBlocks(Phase):
    """This phase computes the sums within each block."""

    light = False

    def __init__(self, sums: PrefixSum) -> None:
        self.sums, self.extent = sums, sums.blocks

    @ti.func
    def size(self, w):
        return self.sums.number(w)

    @ti.func
    def run(self, w, b):
        p, total = self.sums, 0
        for k in range(b * p.block, ti.min((b + 1) * p.block, p.items.size(w))):
            total += p.source[w, k]
            p.target[w, k] = total
        p.before[w, b] = total


class SumOverBlocks(Phase):
    """This phase computes the sum of all blocks before each."""

    def __init__(self, sums: PrefixSum) -> None:
        self.sums = sums

    @ti.func
    def run(self, w, _k):
        p, total = self.sums, 0
        for b in range(p.number(w)):
            own = p.before[w, b]
            p.before[w, b] = total
            total += own
        p.total[w] = total


class AddToBlocks(SumBlocks):
    """This phase adds the sum of the previous blocks to each block."""

    @ti.func
    def run(self, w, b):
        p = self.sums
        before = p.before[w, b]
        if before > 0:
            for k in range(b * p.block, ti.min((b + 1) * p.block, p.items.size(w))):
                p.target[w, k] = p.target[w, k] + before


BLOCK = 64
"""Particles of a block."""


@ti.data_oriented
class BlockSums:
    """Block sums hold ``terms`` sums over each block of particles, side by side; f64."""

    def __init__(self, s: State, terms: int) -> None:
        self.s, self.terms = s, terms
        self.blocks = -(-s.capacity // BLOCK)
        self.partial = ti.Vector.field(terms, ti.f64)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, self.blocks).place(self.partial)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory of the sums, in bytes."""
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
    """This phase is a loop over blocks of particles that also sums the terms of ``each(w, i)``."""

    def __init__(self, sums: BlockSums) -> None:
        self.s, self.sums, self.extent = sums.s, sums, sums.blocks

    @ti.func
    def size(self, w):
        return self.sums.number(w)

    @ti.func
    def each(self, w, i):
        """Process particle i, and return its terms of the sums; f64."""
        return ti.Vector.zero(ti.f64, self.sums.terms)

    @ti.func
    def run(self, w, b):
        total = ti.Vector.zero(ti.f64, self.sums.terms)
        for i in range(b * BLOCK, ti.min((b + 1) * BLOCK, self.s.count[w])):
            total += self.each(w, i)
        self.sums.partial[w, b] = total
