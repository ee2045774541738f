"""Quantities whose accuracy ``tisim cost`` measures in a coalescing cloud: the fraction of grains in
clusters, the density of the asteroid and the largest overlap, over random starts."""

from __future__ import annotations

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import largest_overlap
from tisim.cases.coalescence.measures import Asteroid, Gathering


def overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, divided by the smallest radius."""
    position, radius = result.state["position"], result.state["radius"]
    return largest_overlap(position, radius) / float(radius.min())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return properties of the clusters and the asteroid; the paths of single grains are chaotic."""
    return (
        Quantity("part in clusters", lambda result: Gathering.of(result.state).bound, random=True),
        Quantity("density", lambda result: Asteroid.of(result.state).density, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
