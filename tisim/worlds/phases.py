"""What a step consists of: phases, each a loop over independent items, and repeats of them."""

from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.worlds.state import State


class Phase:
    """A phase is one loop: ``run(w, k)`` is called for k in 0..size(w)-1 when ``when(w)``; ``extent`` bounds
    size.

    ``long`` says that one item is work enough for a launch, ``light`` that a task has many items, on a CPU.
    """

    conditional: ClassVar[bool] = False
    long: bool = False
    extent: int = 1
    light: bool = True

    @property
    def name(self) -> str:
        """Return what the phase is called where a step is explained."""
        return type(self).__name__

    @ti.func
    def when(self, w):
        return 1

    @ti.func
    def size(self, w):
        return 1

    @ti.func
    def run(self, w, k):
        pass


class PerParticle(Phase):
    """This phase is a loop over the live particles of a world.

    local : whether an item reads and writes nothing but its own particle and what its world had before, so
    that it may follow at once when the phase before is done with that particle.
    """

    local: ClassVar[bool] = False

    def __init__(self, s: State) -> None:
        self.s, self.extent = s, s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class Repeat:
    """A repeat takes items in order, again and again while ``pending(w)`` is above zero.

    Items are phases, and further repeats. Only the last phase may change what ``pending`` says, and once it
    says 0, the items of that phase that are left must have nothing to do: they may be skipped.
    """

    def __init__(self, items: "tuple[Item, ...]") -> None:
        self.items = items

    @ti.func
    def pending(self, w):
        return 0


Item = Phase | Repeat


class Nest:
    """A nest is repeats within each other, from the outermost; a loop in them runs while all are pending."""

    def __init__(self, repeats: tuple[Repeat, ...] = ()) -> None:
        self.repeats = repeats
        self.inner: dict[Repeat, Nest] = {}

    def within(self, repeat: Repeat) -> "Nest":
        """Return this nest with a repeat in it; the same object whenever asked, as kernels are compiled for
        each."""
        return self.inner.setdefault(repeat, Nest((*self.repeats, repeat)))

    def phases(self, items: tuple[Item, ...]) -> "Iterator[tuple[Phase, Nest]]":
        """Yield every phase among the items, in order, with the nest that it is in."""
        for item in items:
            if isinstance(item, Repeat):
                yield from self.within(item).phases(item.items)
            else:
                yield item, self
