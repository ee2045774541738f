"""Quantities whose accuracy ``tisim cost`` measures in a draw-down test and in a bed, over random starts."""

from __future__ import annotations

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.cases.granular_bench.bed import centre_height, side_load
from tisim.cases.granular_bench.measures import discharge, repose
from tisim.cases.runs import overlap
from tisim.operators import Passage


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities that a laboratory would measure, and for a bed the largest overlap; the paths of
    grains are chaotic."""
    if any(isinstance(effect, Passage) for effect in scene.effects):
        return (
            Quantity("discharge rate", discharge, random=True),
            Quantity("angle of repose", repose, random=True),
        )
    return (
        Quantity("height of the bed", centre_height, random=True),
        Quantity("load on the side", side_load, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
