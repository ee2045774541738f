"""Quantities whose accuracy ``tisim cost`` measures in a pile before it is spun up: its density and the
largest overlap, over random starts."""

from __future__ import annotations

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.cases.coalescence.accuracy import overlap
from tisim.cases.coalescence.measures import Asteroid


def density(result: Result) -> float:
    """Return the density of the pile at the end, kg/m^3; its critical spin is proportional to the square
    root."""
    return Asteroid.of(result.state).density


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the density and the largest overlap of the pile; the paths of single grains are chaotic."""
    return (
        Quantity("density", density, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
