"""Quantities whose accuracy ``tisim cost`` measures in capture: the captured fraction, over random starts."""

from __future__ import annotations

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.cases.capture.statistics import fraction


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the captured fraction; the paths of single particles are random."""
    return (Quantity("captured fraction", lambda result: fraction(result.state), random=True),)
