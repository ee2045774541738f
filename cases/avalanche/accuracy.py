"""Quantities whose accuracy ``tisim cost`` measures in an avalanche: the angle of repose and the volume of
the heap, over random starts."""

from __future__ import annotations

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.cases.avalanche.measures import grains_volume, heap_volume, overlap, repose


def width(result: Result) -> float:
    """Return the width of the cell of a result, m."""
    return float(result.scene.domain.edges(0.0)[1, 1])


def volume(result: Result) -> float:
    """Return the volume of the heap divided by the volume of its grains."""
    return heap_volume(result.state, width(result)) / grains_volume(result.state)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the properties of the final heap and the largest overlap; the paths of single grains are
    chaotic."""
    return (
        Quantity("angle of repose", lambda result: repose(result.state), random=True),
        Quantity("volume of the heap", volume, random=True),
        Quantity("largest overlap", lambda result: overlap(result.state, width(result)), random=True),
    )
