"""Quantities whose accuracy ``tisim cost`` measures in concentrated samples: chain length and particle
positions, over random starts."""

from __future__ import annotations

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import usual
from tisim.cases.concentration.statistics import chain


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the chain length and the displacements of the particles; capture begins only after some tenths
    of a second."""
    return (
        Quantity("mean chain", lambda result: chain(result.state, result.state["moment"]), random=True),
        *usual(scene),
    )
