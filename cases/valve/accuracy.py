"""Quantities whose accuracy ``tisim cost`` measures in a valve, over random starts: the flow rate in the
field, and the largest overlap."""

from __future__ import annotations

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.cases.runs import overlap
from tisim.cases.valve.measures import flow_rate


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the flow rate and the largest overlap; the paths of single grains are chaotic."""
    return (
        Quantity("mass flow rate at the end", flow_rate, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
