"""What accuracy is of in a cloud that falls together: the part that has agglomerated, and how dense the
asteroid is, over random starts."""

from __future__ import annotations

import numpy as np

from cases.coalescence.measures import Asteroid, Gathering
from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import contacts


def largest_overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, over the smallest radius."""
    position, radius = result.state["position"], result.state["radius"]
    i, j = contacts(position, radius).T
    apart = np.linalg.norm(position[i] - position[j], axis=1)
    return float((radius[i] + radius[j] - apart).max(initial=0.0) / radius.min())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is how many are bound, and how the asteroid is packed."""
    return (
        Quantity("part in clusters", lambda result: Gathering.of(result.state).bound, random=True),
        Quantity("density", lambda result: Asteroid.of(result.state).density, random=True),
        Quantity("largest overlap", largest_overlap, random=True),
    )
