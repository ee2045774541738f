"""A measured setting, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

TRUSTED = 3.0
"""An error is known when it is at least so many times what it may be off by."""


@dataclass(frozen=True)
class Row:
    """What a setting costs, and how accurate it is.

    method : the line that it is on. setting : in words. python : stepper, and laws that were exchanged, as
    Python. options : of ``tisim run``, as a shell takes them. starts : random starts in all that follows.
    seconds : wall seconds of each repeat. steps, sums, rejections : steps, sums of forces and rejected steps
    of a particle, the mean over particles and starts.
    errors : for each quantity the error, and how far that may be off; both relative.
    failed : why there is no result, or nothing.
    """

    method: str
    setting: str
    python: str
    options: str
    precision: str
    starts: int
    seconds: tuple[float, ...] = ()
    steps: float = math.nan
    sums: float = math.nan
    rejections: float = math.nan
    errors: tuple[tuple[float, float], ...] = ()
    failed: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """What it is, whatever came out."""
        return self.method, self.setting

    @property
    def median(self) -> float:
        """Of the wall seconds."""
        return float(np.median(self.seconds)) if self.seconds else math.nan

    @property
    def spread(self) -> float:
        """Longest less shortest of the wall seconds."""
        return max(self.seconds) - min(self.seconds) if self.seconds else math.nan

    def at_most(self, quantity: int = 0) -> float:
        """The error and what it may be off by; infinite when the run has failed."""
        return sum(self.errors[quantity]) if self.errors else math.inf

    def trusted(self, quantity: int = 0) -> bool:
        """Whether the error is large enough, beside what it may be off by, to be known."""
        return bool(self.errors) and self.errors[quantity][0] >= TRUSTED * self.errors[quantity][1]


def cheapest(rows: Iterable[Row], error: float, quantity: int = 0) -> Row | None:
    """The row that takes least time among those whose error is at most this; None where there is none."""
    good = [row for row in rows if row.at_most(quantity) <= error]
    return min(good, key=lambda row: row.median, default=None)


def decades(rows: Sequence[Row], quantity: int = 0) -> dict[float, Row]:
    """The cheapest for each power of ten of the error, down to the least that was met; the largest first."""
    reached = [row.at_most(quantity) for row in rows if 0 < row.at_most(quantity) < math.inf]
    if not reached:
        return {}
    highest, lowest = math.ceil(math.log10(max(reached))), math.ceil(math.log10(min(reached)))
    found = {}
    for power in range(min(highest, 0), lowest - 1, -1):
        row = cheapest(rows, 10.0**power, quantity)
        if row is not None:
            found[10.0**power] = row
    return found
