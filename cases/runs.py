"""Results of runs of a case: that none has failed, and how deep grains overlap."""

from __future__ import annotations

from collections.abc import Sequence

from tisim import Result, RunError
from tisim.analysis import largest_overlap, periodic_sides

OTHER_STARTS = 1_000_000
"""The seeds of runs of which a search is to know nothing are from this one on."""


def sound(results: Sequence[Result]) -> list[Result]:
    """Return results of worlds that are at their end or on the way to it; RunError where one has failed: the
    state of its last good step would be taken for that of the others."""
    for result in results:
        if not result.status.ok and result.status.reason != "running":
            raise RunError(f"{result.scene.name}: {result.status.reason}")
    return list(results)


def overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, over the mean radius of all."""
    position, radius = result.state["position"], result.state["radius"]
    return largest_overlap(position, radius, periodic_sides(result.scene.domain, result.time)) / float(
        radius.mean()
    )
