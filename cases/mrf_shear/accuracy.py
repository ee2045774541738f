"""Quantities whose accuracy ``tisim cost`` measures in a sheared cell, over random starts: shear stress and
largest overlap."""

from __future__ import annotations

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.cases.mrf_shear.measures import shear_stress
from tisim.cases.runs import overlap


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the stress of the fluid and the largest overlap; the paths of single grains are chaotic."""
    return (
        Quantity("shear stress", shear_stress, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
