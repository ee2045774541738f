"""The quantities whose accuracy ``tisim cost`` measures in a valve, over random starts: how much still flows
in the field, and how deep grains overlap."""

from __future__ import annotations

from tisim.cases.runs import overlap
from tisim.cases.valve.measures import flow_rate

from tisim import Scene
from tisim.accuracy import Quantity


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Paths of grains are chaotic; what counts is what flows."""
    return (
        Quantity("mass flow rate at the end", flow_rate, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
