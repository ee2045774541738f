"""A step as a list of loops, and the three ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step, some of them in
a ``Repeat``. The same phases run on three schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"team"     - so does a team of threads: each takes a share of the items of a phase, and they wait for each
             other, awake, before the next (team.py): the way for large systems on many cores of a CPU, or
             smaller ones in which all feel each other. Where other programs want the cores, each thread
             takes a world alone meanwhile (team.py).
"particle" - each phase is one loop of a launch over all particles of all worlds: the way for GPUs, and for
             phases of few long items on a CPU, where threads take tasks as they are done with others. What
             may be repeated begins a launch of its own. On a GPU many steps are launched in a row before
             anybody asks how far worlds have come.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
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
    """These rules say, in kernels, which worlds go on, and how far.

    rest_every : worlds rest after a number of steps that is a multiple of this one, for what is done there.
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
        """Stop a world in which a phase has failed, once all of its items have been heard."""
        if self.s.failed[w] > 0:
            self.s.status[w], self.s.place[w] = self.s.failed[w], NOWHERE


class Program(ABC):
    """A program is one step of every running world, compiled for a state and a list of items."""

    items: tuple[Item, ...]

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps of every running world; none goes on past its ``pause_time`` or its
        ``goal``, or after a launch that has left a step under way."""

    @abstractmethod
    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""

    def names(self) -> list[str]:
        """Return what runs in a step, in order; repeated phases have a star for each repeat that they are
        in."""
        return [phase.name + "*" * depth for phase, depth in nested(self.items)]


OVER = 2**30
"""This route says that the step is over."""
NOWHERE = -1
"""This is the place of a world that does not go on."""


class Fork:
    """A fork leads a world into a repeat while it is pending, else past it."""

    # No dataclass: Quadrants takes those apart, and forks lie within forks.
    def __init__(self, repeat: Repeat, inside: "Route", past: "Route") -> None:
        # In a tuple, out of which kernels of Quadrants take one fork within another.
        self.repeat, self.ways = repeat, (inside, past)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Fork) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash((self.repeat, self.ways))


Route = Fork | int
"""A route is a fork, or so many places on from where one is, or ``OVER``. That it tells no places makes
launches of the same phases the same, wherever they are."""

Items = tuple[Item, ...]


def first_group(items: Items) -> tuple[tuple[Phase, ...] | Repeat, Items]:
    """Return what begins these items, the phases that one launch takes or a repeat, and what follows it."""
    if isinstance(items[0], Repeat):
        return items[0], items[1:]
    phases = tuple(next(group for _, group in groupby(items, lambda item: isinstance(item, Repeat))))
    return tuple(phase for phase in phases if isinstance(phase, Phase)), items[len(phases) :]


def launch_count(items: Items) -> int:
    """Return how many launches these items take, each repeat once."""
    number = 0
    while items:
        first, items = first_group(items)
        number += launch_count(first.items) if isinstance(first, Repeat) else 1
    return number


def entry(items: Items, place: int, after: Callable[[int], Route], here: int) -> Route:
    """Return the route, from ``here``, of a world that comes to these items.

    place : that of their first launch. after : makes the route of a world that is through with them.
    """
    if not items:
        return after(here)
    first, rest = first_group(items)
    if not isinstance(first, Repeat):
        return place - here
    inside = entry(first.items, place, partial(entry, items, place, after), here)
    return Fork(first, inside, entry(rest, place + launch_count(first.items), after, here))
