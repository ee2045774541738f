"""The quantities whose accuracy ``tisim cost`` measures in a cloud that falls together: the part that has
agglomerated, and how dense the asteroid is, over random starts."""

from __future__ import annotations

from tisim.cases.coalescence.measures import Asteroid, Gathering

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import largest_overlap


def overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, over the smallest radius."""
    position, radius = result.state["position"], result.state["radius"]
    return largest_overlap(position, radius) / float(radius.min())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is how many are bound, and how the asteroid is packed."""
    return (
        Quantity("part in clusters", lambda result: Gathering.of(result.state).bound, random=True),
        Quantity("density", lambda result: Asteroid.of(result.state).density, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
