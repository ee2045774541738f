"""The quantities whose accuracy ``tisim cost`` measures in concentrated samples: chains, and where particles
are, over random starts."""

from __future__ import annotations

from tisim.cases.concentration.statistics import chain

from tisim import Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import usual


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return how long chains are, and how far particles get; before some tenths of a second nothing is
    caught."""
    return (
        Quantity("mean chain", lambda result: chain(result.state, result.state["moment"]), random=True),
        *usual(scene),
    )
