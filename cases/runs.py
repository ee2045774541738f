"""Results of runs of a case, of which none has failed."""

from __future__ import annotations

from collections.abc import Sequence

from tisim import Result, RunError


def sound(results: Sequence[Result]) -> list[Result]:
    """Return results of worlds that are at their end or on the way to it; RunError where one has failed: the
    state of its last good step would be taken for that of the others."""
    for result in results:
        if not result.status.ok and result.status.reason != "running":
            raise RunError(f"{result.scene.name}: {result.status.reason}")
    return list(results)
