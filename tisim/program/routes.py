"""Where a world goes on after a launch: each launch of a step has a place, and repeats are forks between
them."""

from collections.abc import Callable
from functools import partial
from itertools import groupby

from tisim.program.phases import Item, Phase, Repeat

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
