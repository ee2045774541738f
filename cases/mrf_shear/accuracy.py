"""The quantities whose accuracy ``tisim cost`` measures in a sheared cell, over random starts: shear stress,
and how deep grains overlap."""

from __future__ import annotations

from tisim.cases.mrf_shear.measures import shear_stress
from tisim.cases.runs import overlap

from tisim import Scene
from tisim.accuracy import Quantity


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is the stress of the fluid."""
    return (
        Quantity("shear stress", shear_stress, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
