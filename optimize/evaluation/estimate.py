"""Fitness averaged over random starts, and when the average has converged (Z04 Eq. 8.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tisim.numerics.skewed import interval
from tisim.numerics.statistics import CONFIDENCE


@dataclass(frozen=True)
class FitnessEstimate:
    """Fitness of one design.

    mean : of the first `starts` starts, +inf if the design failed. std : sample standard deviation.
    low, high : ends of the confidence interval of the mean (tisim.numerics.skewed), 95 % unless said
    otherwise. It holds for starts that have not had a part in choosing the design. converged : Eq. 8.1 was
    met. reason : "" or why the design failed. std, low and high are NaN where they are not known, and for
    failed designs.
    """

    mean: float
    std: float
    low: float
    high: float
    starts: int
    converged: bool
    reason: str = ""

    @property
    def ok(self) -> bool:
        return not self.reason

    @property
    def exact(self) -> bool:
        """Whether all starts are known to be the same, so that the interval has no width."""
        return self.low == self.high

    @property
    def half_width(self) -> float:
        """Half of the width of the interval."""
        return (self.high - self.low) / 2

    @property
    def standard_error(self) -> float:
        """The standard error of the mean; NaN for one start."""
        return self.std / math.sqrt(self.starts) if self.starts else math.nan

    @classmethod
    def of(
        cls,
        values: Sequence[float],
        converged: bool,
        seen: Sequence[float] = (),
        skewness: float | None = None,
        confidence: float = CONFIDENCE,
    ) -> FitnessEstimate:
        """Return the estimate from the fitness of each start; at least one.

        seen : values that may occur: starts that are all equal do not exclude these. skewness : of what the
        values are drawn from, where other designs tell it. confidence : of the interval.
        """
        n = len(values)
        mean = float(np.cumsum(values)[-1] / n)  # summed as in converged_after, to the last bit
        std = float(np.std(values, ddof=1)) if n > 1 else math.nan
        return cls(mean, std, *interval(values, seen, skewness, confidence), n, converged)

    @classmethod
    def certain(cls, value: float) -> FitnessEstimate:
        """Return the estimate of a design all of whose starts are the same."""
        return cls(value, 0.0, value, value, 1, True)

    @classmethod
    def failed(cls, starts: int, reason: str) -> FitnessEstimate:
        """Return the estimate of a design of which a run failed, or could not be made."""
        return cls(math.inf, math.nan, math.nan, math.nan, starts, False, reason)


def converged_after(values: ArrayLike, tolerance: float, min_starts: int) -> int | None:
    """Return the least number of starts n = E + 1 >= min_starts with |mean_n - mean_E| < TOL |mean_n| (Z04
    Eq. 8.1).

    values : shape (starts,) or (starts, objectives); of several objectives each must meet it at once.
    Two equal means count as converged, also when both are zero. None if there is no such n in values.
    """
    numbers = np.asarray(values, dtype=float)
    columns = numbers.reshape(len(numbers), -1)
    means = np.cumsum(columns, axis=0) / np.arange(1, len(columns) + 1)[:, None]
    for n in range(max(min_starts, 2), len(columns) + 1):
        change = np.abs(means[n - 1] - means[n - 2])
        if np.all((change == 0) | (change < tolerance * np.abs(means[n - 1]))):
            return n
    return None
