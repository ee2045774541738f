"""What a step consists of: phases, each a loop over independent items, and repeats of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.state.state import State

MANY = 1000
"""With so many particles, items of unlike length are work enough for a launch (measured on 2 cores: launches
cost a step 0.2 ms, as much as the pairs of 400)."""


class Phase:
    """A phase is one loop: ``run(w, k)`` is called for k in 0..size(w)-1 when ``when(w)``; ``extent`` bounds
    size.

    ``long`` says that one item is work enough for a launch, ``light`` that else a task has many, on a CPU;
    ``others`` how many other particles an item goes through one by one: by it the schedule is chosen
    (engine/schedule_choice.py), and how long a team waits for a thread.
    """

    conditional: ClassVar[bool] = False
    long: bool = False
    extent: int = 1
    light: bool = True
    others: int = 0

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

    Items are phases, at least one, and further repeats. ``pending`` is asked before the first and after the
    last of them. So many turns as are ``usual`` in a step are launched before anybody asks.
    """

    usual: int = 1

    def __init__(self, items: tuple[Item, ...]) -> None:
        self.items = items

    @ti.func
    def pending(self, w):
        return 0


Item = Phase | Repeat


def nested(items: tuple[Item, ...], depth: int = 0) -> Iterator[tuple[Phase, int]]:
    """Yield every phase among the items, in order, with the number of repeats that it is in."""
    for item in items:
        if isinstance(item, Repeat):
            yield from nested(item.items, depth + 1)
        else:
            yield item, depth


class WorldAction(ABC):
    """A world action is what an operator does to a world in loops over its particles.

    It is a ``ti.data_oriented`` object with device memory of its own.
    """

    @abstractmethod
    def phases(self) -> tuple[Item, ...]:
        """Return the items of the action, which are taken in every step: a repeat that is pending only where
        there is something to do costs others next to nothing.

        What they come to may not depend on the order of parallel work.
        """

    @abstractmethod
    def bytes(self) -> int:
        """Return the device memory, in bytes."""
