"""What accuracy is of in a draw-down test: the angle of repose and the discharge rate, over random starts."""

from __future__ import annotations

from cases.granular_bench.measures import discharge, repose
from tisim import Scene
from tisim.accuracy import Quantity


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is what a laboratory would measure."""
    return (
        Quantity("discharge rate", discharge, random=True),
        Quantity("angle of repose", repose, random=True),
    )
