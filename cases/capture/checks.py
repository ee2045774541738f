"""Checks of capture: B16's conclusions for one cylinder."""

from collections.abc import Iterator

from tisim.cases.capture import regions
from tisim.cases.capture.statistics import (
    CHECK_REPEATS,
    of_aspect,
    of_diffusion,
    of_orientation,
    of_size,
)
from tisim.cases.case import Check, Claim


def check(repeats: int = CHECK_REPEATS) -> Iterator[Check | Claim]:
    """Yield B16's conclusions for one cylinder, each with its confidence interval."""
    yield from of_orientation(repeats)
    yield from of_aspect(repeats)
    yield from regions.check(repeats)
    yield from of_size(repeats)
    yield from of_diffusion(repeats)
