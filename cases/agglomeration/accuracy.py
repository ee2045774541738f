"""Quantities whose accuracy ``tisim cost`` measures in the flow of Z04: the mean radius at the end, over
random starts (seeds)."""

from __future__ import annotations

from tisim import Result, Scene
from tisim.accuracy import Quantity


def mean_radius(result: Result) -> float:
    """Return the mean radius of the grains at the end, m."""
    return float(result.state["radius"].mean())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the mean radius; impacts are chaotic, so a change in the last digit gives other agglomerates but
    the same mean."""
    return (Quantity("mean radius", mean_radius, random=True),)
