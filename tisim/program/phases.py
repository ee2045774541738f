"""Phases, each a loop over independent items, and repeats of phases: the building blocks of a step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.state.state import State

MANY = 1000
"""From this many particles on, items of unequal length are enough work for a launch (measured on 2 cores:
launches cost a step 0.2 ms, the same as the pairs of 400 particles)."""


class Phase:
    """A phase is one loop: ``run(w, k)`` is called for k in 0..size(w)-1 if ``when(w)``; ``extent`` bounds
    size.

    long : whether one item is enough work for a launch.
    light : whether a task otherwise has many items, on a CPU.
    others : number of other particles that an item loops over. It determines the choice of the schedule
    (``choose`` in engine/compiled_worlds.py) and how long a team waits for a thread.
    """

    conditional: ClassVar[bool] = False
    long: bool = False
    extent: int = 1
    light: bool = True
    others: int = 0

    @property
    def name(self) -> str:
        """Return the name of the phase in the description of a step."""
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

    local : whether an item reads and writes only its own particle and earlier values of its world. It may
    then run as soon as the previous phase has finished that particle.
    """

    local: ClassVar[bool] = False

    def __init__(self, s: State) -> None:
        self.s, self.extent = s, s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class Repeat:
    """A repeat runs items in order, again and again, while ``pending(w)`` is above zero.

    Items are phases, at least one, and further repeats. ``pending`` is evaluated before the first and after
    the last item.

    usual : turns that are launched before the progress is read.
    """

    usual: int = 1

    def __init__(self, items: tuple[Item, ...]) -> None:
        self.items = items

    @ti.func
    def pending(self, w):
        return 0


Item = Phase | Repeat


def nested(items: tuple[Item, ...], depth: int = 0) -> Iterator[tuple[Phase, int]]:
    """Yield every phase among the items, in order, with the number of repeats around it."""
    for item in items:
        if isinstance(item, Repeat):
            yield from nested(item.items, depth + 1)
        else:
            yield item, depth


class WorldAction(ABC):
    """A world action is the work of an operator on a world, in loops over its particles.

    It is a ``ti.data_oriented`` object with device memory of its own.
    """

    @abstractmethod
    def phases(self) -> tuple[Item, ...]:
        """Return the items of the action, which run in every step.

        A repeat that is pending only when there is work costs next to nothing otherwise. The result must not
        depend on the order of parallel work.
        """

    @abstractmethod
    def bytes(self) -> int:
        """Return the device memory, in bytes."""
