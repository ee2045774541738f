"""The quantities whose accuracy ``tisim cost`` measures in a pile that is to be spun up: how it is packed,
over random starts."""

from __future__ import annotations

from tisim.cases.coalescence.accuracy import overlap
from tisim.cases.coalescence.measures import Asteroid

from tisim import Result, Scene
from tisim.accuracy import Quantity


def density(result: Result) -> float:
    """Return the density of the pile at the end, kg/m^3: the spin that it can bear goes by its root."""
    return Asteroid.of(result.state).density


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is the pile that they make."""
    return (
        Quantity("density", density, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
