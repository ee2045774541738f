"""A measured setting, and the choice of the cheapest.

Timings that overlap within their uncertainty are treated as equal. Among such settings the one with the
fewest force evaluations, which is independent of the machine, is chosen, unless another setting is both
faster and more accurate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

TRUSTED = 3.0
"""An error counts as known if it is at least this many times its uncertainty."""
TIMED_ONCE, TIMED_OFTEN = 0.15, 0.05
"""Relative uncertainty of a time that was measured once, and more than once."""
CLOCK_RESOLUTION = 1e-3
"""Smallest uncertainty of a time, s."""
ROUNDING = 1e-11
"""Two relative errors that differ by at most this are equal up to rounding; such laws give the same
result."""


@dataclass(frozen=True)
class Row:
    """A row of a study: the cost and the error of one setting.

    method : name of its sweep, which is one line in the picture.
    setting : description of the setting.
    python : stepper, and exchanged laws and materials, as Python.
    options : options of ``tisim run`` that produce the setting, as a shell line.
    starts : number of random starts of each run.
    seconds : wall seconds of each repeat; the limit if the run was stopped for taking too long.
    steps, sums, rejections : steps, force evaluations and rejected steps per particle, averaged over
        particles and starts.
    errors : for each quantity its relative error, and the uncertainty of that error.
    failed : the reason for a missing result, otherwise empty.
    same : whether this is a cheaper law that gives the same errors here as the law it approximates.
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
        """The method and the setting, which identify a row."""
        return self.method, self.setting

    @property
    def median(self) -> float:
        """The median of the wall seconds of all repeats, s; NaN if there are none."""
        return float(np.median(self.seconds)) if self.seconds else math.nan

    @property
    def spread(self) -> float:
        """The longest minus the shortest of the wall seconds of all repeats, s."""
        return max(self.seconds) - min(self.seconds) if self.seconds else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The shortest and the longest plausible wall time of the setting, s: the measured range, widened by
        the uncertainty of timing."""
        uncertainty = max(
            CLOCK_RESOLUTION, (TIMED_OFTEN if len(self.seconds) > 1 else TIMED_ONCE) * self.median
        )
        return min(*self.seconds, self.median - uncertainty), max(*self.seconds, self.median + uncertainty)

    @property
    def stopped_after(self) -> float:
        """The time limit at which the run was stopped, wall seconds; infinite for all other rows."""
        return max(self.seconds) if self.failed and self.seconds else math.inf

    def same_errors(self, other: Row) -> bool:
        """Return whether another row has the same errors up to rounding."""
        if other is self or not (self.errors and other.errors):
            return False
        return all(abs(a[0] - b[0]) <= ROUNDING for a, b in zip(self.errors, other.errors, strict=True))

    def at_most(self, quantity: int = 0) -> float:
        """Return the relative error of a quantity plus its uncertainty; infinite if the run has failed."""
        return sum(self.errors[quantity]) if self.errors else math.inf

    def trusted(self, quantity: int = 0) -> bool:
        """Return whether the error of a quantity is well above its uncertainty."""
        return bool(self.errors) and self.errors[quantity][0] >= TRUSTED * self.errors[quantity][1]


def tied(rows: Iterable[Row], error: float, quantity: int = 0) -> list[Row]:
    """Return the fastest rows, within the timing uncertainty, among rows whose error of a quantity is at most
    ``error``. The first is the recommended one: of the rows that no other row beats in both time and error,
    it takes the least work."""
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
    """Return ``tied`` for each power of ten of the error, from the largest error down to the smallest
    reached."""
    reached = [row.at_most(quantity) for row in rows if 0 < row.at_most(quantity) < math.inf]
    if not reached:
        return {}
    highest, lowest = math.ceil(math.log10(max(reached))), math.ceil(math.log10(min(reached)))
    by_error = {}
    for power in range(min(highest, 0), lowest - 1, -1):
        if best := tied(rows, 10.0**power, quantity):
            by_error[10.0**power] = best
    return by_error
