"""Parallel radix sort by integer keys: stable passes over the digits, from the lowest on."""

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.program.phases import Item, Phase, Repeat
from tisim.program.scans import PrefixSum
from tisim.state.state import State

DIGIT_BITS = 8
BASE = 1 << DIGIT_BITS
SORT_BLOCK = {"cpu": 1024}
"""Items that one task counts and moves, one after the other; 64 on other devices."""


@ti.data_oriented
class RadixSort:
    """A radix sort orders items of each world by keys: ``order[w, k]`` is the item in place k.

    Keys are set with ``set_key``; items with equal keys stay in the order of their numbers. The order depends
    on the keys alone.

    items : a phase of the same extent and size. bits : number of bits of the keys.
    """

    def __init__(self, s: State, items: Phase, bits: int) -> None:
        self.s, self.items, self.capacity = s, items, items.extent
        # With an even number of passes the result ends in the half in which the first pass began.
        self.passes = 2 * -(-bits // (2 * DIGIT_BITS))
        self.block = SORT_BLOCK.get(runtime.current().device, 64)
        self.blocks = -(-items.extent // self.block)
        self.key, self.order = ti.field(ti.i64), ti.field(ti.i32)
        self.start, self.done = ti.field(ti.i32), ti.field(ti.i32)
        builder = Builder()
        # Two halves; each pass moves the items from one to the other.
        for column in (self.key, self.order):
            builder.dense(ti.i, s.worlds).dense(ti.j, 2 * self.capacity).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, BASE * self.blocks + 1).place(self.start)
        builder.dense(ti.i, s.worlds).place(self.done)
        self.tree = Tree(builder)
        self.starts = PrefixSum(s, OfDigits(self), self.start, self.start)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes + self.starts.bytes()

    def phases(self) -> tuple[Item, ...]:
        """Return the items that sort the worlds for which ``begin`` has been called."""
        return (SortByDigits(self),)

    @ti.func
    def begin(self, w):
        """Request the sorting of a world, in a phase before keys are set."""
        self.done[w] = 0

    @ti.func
    def set_key(self, w, k, key):
        """Set the key of item k, at least 0; i64."""
        self.key[w, k], self.order[w, k] = key, k

    @ti.func
    def digit(self, w, at):
        """Return the digit of the current pass for an entry of either half."""
        return ti.cast(self.key[w, at] >> (DIGIT_BITS * self.done[w]) & (BASE - 1), ti.i32)

    @ti.func
    def half(self, w):
        """Return the first place of the half that holds the items before this pass."""
        return self.done[w] % 2 * self.capacity

    @ti.func
    def number(self, w):
        """Return the number of blocks in use."""
        return (self.items.size(w) + self.block - 1) // self.block


class SortByDigits(Repeat):
    """This item sorts by one digit after the other."""

    def __init__(self, sort: RadixSort) -> None:
        super().__init__((CountDigits(sort), *sort.starts.phases(), MoveByDigit(sort), EndPass(sort)))
        self.sort, self.usual = sort, sort.passes

    @ti.func
    def pending(self, w):
        return self.sort.passes - self.sort.done[w]


class OfDigits(Phase):
    """Base of the phases that work on each digit of each block, and on the end of the last."""

    def __init__(self, sort: RadixSort) -> None:
        self.sort, self.extent = sort, BASE * sort.blocks + 1

    @ti.func
    def size(self, w):
        return BASE * self.sort.number(w) + 1


class OfDigitBlocks(Phase):
    """Base of the phases that work on each block of items."""

    light = False

    def __init__(self, sort: RadixSort) -> None:
        self.sort, self.extent = sort, sort.blocks

    @ti.func
    def size(self, w):
        return self.sort.number(w)

    @ti.func
    def end(self, w, b):
        """Return the item after the last of a block."""
        return ti.min((b + 1) * self.sort.block, self.sort.items.size(w))


class CountDigits(OfDigitBlocks):
    """This phase counts the occurrences of each digit in a block."""

    @ti.func
    def run(self, w, b):
        a, number = self.sort, self.sort.number(w)
        if b == 0:
            a.start[w, 0] = 0
        # Counts are shifted by one, so that each prefix sum is the first place of the items of a digit.
        for digit in range(BASE):
            a.start[w, digit * number + b + 1] = 0
        for k in range(b * a.block, self.end(w, b)):
            at = a.digit(w, a.half(w) + k) * number + b + 1
            a.start[w, at] = a.start[w, at] + 1


class MoveByDigit(OfDigitBlocks):
    """This phase moves the items of a block to the places of their digits, in their current order."""

    @ti.func
    def run(self, w, b):
        a, number = self.sort, self.sort.number(w)
        source = a.half(w)
        target = a.capacity - source
        for k in range(b * a.block, self.end(w, b)):
            at = a.digit(w, source + k) * number + b
            place = a.start[w, at]
            a.start[w, at] = place + 1
            a.key[w, target + place] = a.key[w, source + k]
            a.order[w, target + place] = a.order[w, source + k]


class EndPass(Phase):
    """This phase advances to the next digit."""

    def __init__(self, sort: RadixSort) -> None:
        self.sort = sort

    @ti.func
    def run(self, w, _k):
        self.sort.done[w] = self.sort.done[w] + 1
