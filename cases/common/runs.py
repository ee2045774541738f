"""Runs of a case: groups of runs from several starts, a test for failed runs, and the largest overlap of
grains."""

from collections.abc import Callable, Sequence

import numpy as np

from tisim import Result, RunError, Scene, run
from tisim.analysis import largest_overlap, periodic_sides
from tisim.engine.batches import Progress

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


def grouped(scenes: Sequence[Scene], starts: int, progress: Progress | None = None) -> list[list[Result]]:
    """Return the results of scenes in groups of ``starts``; RunError if a run fails."""
    results = sound(run(list(scenes), progress))
    return [results[k : k + starts] for k in range(0, len(results), starts)]


def overlap(result: Result, over: Callable[[np.ndarray], float] = np.mean) -> float:
    """Return the largest overlap of two grains at the end, divided by their mean radius.

    over : computes the radius to divide by from the radii of all grains.
    """
    position, radius = result.state["position"], result.state["radius"]
    sides = periodic_sides(result.scene.domain, result.time)
    return largest_overlap(position, radius, sides) / float(over(radius))
