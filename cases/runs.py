"""Results of the runs of a case: a test for failed runs, and the largest overlap of grains."""

from __future__ import annotations

from collections.abc import Sequence

from tisim import Result, RunError
from tisim.analysis import largest_overlap, periodic_sides

OTHER_STARTS = 1_000_000
"""The first of the held-out seeds, which no search uses."""


def sound(results: Sequence[Result]) -> list[Result]:
    """Return results of worlds that have ended or are still running; RunError if one has failed.

    Without this test, the last good state of a failed world would be used like the results of the others.
    """
    for result in results:
        if not result.status.ok and result.status.reason != "running":
            raise RunError(f"{result.scene.name}: {result.status.reason}")
    return list(results)


def overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, divided by the mean radius."""
    position, radius = result.state["position"], result.state["radius"]
    return largest_overlap(position, radius, periodic_sides(result.scene.domain, result.time)) / float(
        radius.mean()
    )
