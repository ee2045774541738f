"""A measured setting, and the choice among them.

Timings that overlap are not told apart: among settings that take the least time as far as can be seen, the
one with the fewest force evaluations is chosen, which no machine changes, unless the table shows another to
be both faster and more accurate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

TRUSTED = 3.0
"""An error is known when it is at least so many times what it may be off by."""
TIMED_ONCE, TIMED_OFTEN = 0.15, 0.05
"""A time is known to this part of itself at best: where it was taken once, and more often than once."""
CLOCK_RESOLUTION = 1e-3
"""A time is known to so much at best, s."""
ROUNDING = 1e-11
"""Rounding makes a difference of two relative errors as large as this; such laws have done the same."""


@dataclass(frozen=True)
class Row:
    """A row of a study says what a setting costs and how accurate it is.

    method : the name of its sweep, a line in the picture. setting : its description.
    python : stepper, and laws and materials that were exchanged, as Python. options : those of ``tisim run``
    that make the setting, as a shell takes them. starts : the number of random starts that all that follows
    is of.
    seconds : wall seconds of each repeat. steps, sums, rejections : steps, force evaluations and rejected
    steps of a particle, the mean over particles and starts.
    errors : for each quantity the error, and how far that may be off; both relative.
    failed : why there is no result, or nothing; of a run that was stopped as it took too long ``seconds`` is
    the limit. same : whether it is a cheaper law that makes no difference here to the law it stands for.
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
    same: bool = False
    arithmetic: str = "strict"

    @property
    def key(self) -> tuple[str, str]:
        """The method and the setting, by which a row is found again."""
        return self.method, self.setting

    @property
    def median(self) -> float:
        """The median of the wall seconds of all repeats, s; NaN before there is one."""
        return float(np.median(self.seconds)) if self.seconds else math.nan

    @property
    def spread(self) -> float:
        """The longest less the shortest of the wall seconds of all repeats, s."""
        return max(self.seconds) - min(self.seconds) if self.seconds else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The least and the most wall time that the setting may take, s: as measured, but no closer than a
        clock tells."""
        uncertainty = max(
            CLOCK_RESOLUTION, (TIMED_OFTEN if len(self.seconds) > 1 else TIMED_ONCE) * self.median
        )
        return min(*self.seconds, self.median - uncertainty), max(*self.seconds, self.median + uncertainty)

    @property
    def stopped_after(self) -> float:
        """The limit at which it was stopped, wall seconds; infinite for any other row."""
        return max(self.seconds) if self.failed and self.seconds else math.inf

    def same_errors(self, other: Row) -> bool:
        """Return whether another row has the same errors, but for rounding."""
        if other is self or not (self.errors and other.errors):
            return False
        return all(abs(a[0] - b[0]) <= ROUNDING for a, b in zip(self.errors, other.errors, strict=True))

    def at_most(self, quantity: int = 0) -> float:
        """Return the relative error of a quantity and what it may be off by, in sum; infinite when the run
        has failed."""
        return sum(self.errors[quantity]) if self.errors else math.inf

    def trusted(self, quantity: int = 0) -> bool:
        """Return whether the error of a quantity is large enough, beside what it may be off by, to be
        known."""
        return bool(self.errors) and self.errors[quantity][0] >= TRUSTED * self.errors[quantity][1]


def tied(rows: Iterable[Row], error: float, quantity: int = 0) -> list[Row]:
    """Return the rows that take least time, as far as timings tell, among those whose error of a quantity is
    at most this. The one to choose is the first: it takes the least work of those that no other row beats in
    both time and error."""
    good = [row for row in rows if row.at_most(quantity) <= error and not row.same]
    if not good:
        return []
    _, latest = min((row.interval for row in good), key=lambda interval: interval[1])
    fast = [row for row in good if row.interval[0] <= latest]

    def beaten(row: Row) -> bool:
        return any(
            other.median < row.median and other.at_most(quantity) < row.at_most(quantity) for other in good
        )

    return sorted(fast, key=lambda row: (beaten(row), row.sums * row.starts, row.median))


def decades(rows: Sequence[Row], quantity: int = 0) -> dict[float, list[Row]]:
    """Return ``tied`` for each power of ten of the error, from the largest down to the least that was met."""
    reached = [row.at_most(quantity) for row in rows if 0 < row.at_most(quantity) < math.inf]
    if not reached:
        return {}
    highest, lowest = math.ceil(math.log10(max(reached))), math.ceil(math.log10(min(reached)))
    by_error = {}
    for power in range(min(highest, 0), lowest - 1, -1):
        if best := tied(rows, 10.0**power, quantity):
            by_error[10.0**power] = best
    return by_error
