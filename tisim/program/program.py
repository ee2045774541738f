"""A step is a list of loops, which run on one of three schedules.

A ``Phase`` is one loop over independent items of a world (its particles, its contacts, or the world itself).
A ``Program`` is the list of phases of one step, some of them inside a ``Repeat``. The same phases run on
three schedules with bitwise equal results:

"world"    - a thread takes a world through many steps in one launch. There are no launches or barriers
             between phases, and the world stays in cache. For batches and small systems on a CPU.
"team"     - a team of threads does the same. Each thread takes a share of the items of a phase, and all
             wait in a busy loop for the others before the next phase (team.py). For large systems on a
             CPU with many cores, or smaller ones with all-pairs interactions. While other programs use
             the cores, each thread takes a world alone.
"particle" - each phase is one loop of a launch over all particles of all worlds. For GPUs, and for phases
             with few long items on a CPU, where idle threads take the next task. Each repeat begins a
             launch of its own. On a GPU many steps are launched before the progress is read.

The results are bitwise equal because phases combine values only by sums in a fixed order, integer atomics,
and floating-point minima and maxima. None of these depends on the order of parallel work.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from itertools import groupby

from tisim.backend.taichi import ti
from tisim.program.phases import Item, Phase, Repeat, nested
from tisim.state.state import State
from tisim.state.status import NEVER


class StepRules:
    """Rules, evaluated in kernels, for which worlds continue and how far.

    rest_every : worlds pause after each multiple of this number of steps for work between launches.
    """

    def __init__(self, s: State, rest_every: int = NEVER) -> None:
        self.s, self.rest_every = s, rest_every

    @ti.func
    def _allow_world(self, w, steps):
        limit = ti.min(self.s.steps[w] + steps, self.s.goal[w])
        if ti.static(self.rest_every < NEVER):
            limit = ti.min(limit, (self.s.steps[w] // self.rest_every + 1) * self.rest_every)
        self.s.step_limit[w] = limit

    @ti.func
    def _waits(self, w):
        return self.s.time[w] >= self.s.pause_time[w] or self.s.steps[w] >= self.s.step_limit[w]

    @ti.func
    def _stop_failed(self, w):
        """Stop a world in which a phase has failed, after all items of the phase have finished."""
        if self.s.failed[w] > 0:
            self.s.status[w], self.s.place[w] = self.s.failed[w], NOWHERE


class Program(ABC):
    """A program is one step of every running world, compiled for a state and a list of items."""

    items: tuple[Item, ...]

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps of every running world.

        No world continues past its ``pause_time`` or its ``goal``, or after a launch that has left a step
        under way.
        """

    @abstractmethod
    def compile(self) -> None:
        """Compile the code of ``advance`` without running it: no world may be running."""

    def names(self) -> list[str]:
        """Return the names of the phases of a step, in order, with one star for each repeat around a
        phase."""
        return [phase.name + "*" * depth for phase, depth in nested(self.items)]

    def outline(self) -> list[str]:
        """Return the names of the items of a step, in order; a repeat is one item, with a star."""
        return [f"{type(item).__name__}*" if isinstance(item, Repeat) else item.name for item in self.items]


OVER = 2**30
"""The route at the end of a step."""
NOWHERE = -1
"""The place of a world that does not continue."""


class Fork:
    """A fork leads a world into a repeat while it is pending, and otherwise past it."""

    # Not a dataclass: Quadrants takes dataclasses apart, and forks are nested.
    def __init__(self, repeat: Repeat, inside: "Route", past: "Route") -> None:
        # A tuple, because kernels of Quadrants can take a nested fork out of it.
        self.repeat, self.ways = repeat, (inside, past)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Fork) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash((self.repeat, self.ways))


Route = Fork | int
"""A route is a fork, or an offset to the next place, or ``OVER``. As it has no absolute places, launches of
the same phases are equal at any place."""

Items = tuple[Item, ...]


def first_group(items: Items) -> tuple[tuple[Phase, ...] | Repeat, Items]:
    """Return the first group of items, either the phases of one launch or a repeat, and the remaining
    items."""
    if isinstance(items[0], Repeat):
        return items[0], items[1:]
    phases = tuple(next(group for _, group in groupby(items, lambda item: isinstance(item, Repeat))))
    return tuple(phase for phase in phases if isinstance(phase, Phase)), items[len(phases) :]


def launch_count(items: Items) -> int:
    """Return the number of launches of these items, with each repeat counted once."""
    number = 0
    while items:
        first, items = first_group(items)
        number += launch_count(first.items) if isinstance(first, Repeat) else 1
    return number


def entry(items: Items, place: int, after: Callable[[int], Route], here: int) -> Route:
    """Return the route from ``here`` of a world that comes to these items.

    place : place of their first launch.
    after : makes the route of a world that has finished them.
    """
    if not items:
        return after(here)
    first, rest = first_group(items)
    if not isinstance(first, Repeat):
        return place - here
    inside = entry(first.items, place, partial(entry, items, place, after), here)
    return Fork(first, inside, entry(rest, place + launch_count(first.items), after, here))
