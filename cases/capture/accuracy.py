"""The quantities whose accuracy ``tisim cost`` measures in capture: how many particles are caught, over
random starts."""

from __future__ import annotations

from tisim.cases.capture.statistics import fraction

from tisim import Scene
from tisim.accuracy import Quantity


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths are random; what counts is how many are caught."""
    return (Quantity("captured fraction", lambda result: fraction(result.state), random=True),)
