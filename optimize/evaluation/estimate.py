"""Fitness over random starts, and the test for its convergence (Z04 Eq. 8.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.statistic import NO_OTHERS, Others


@dataclass(frozen=True)
class FitnessEstimate:
    """Fitness of one design.

    mean : mean over the first `starts` starts, or another statistic if the objective has one; +inf if the
        design failed.
    std : standard deviation between starts; for another statistic, of its pseudo-values.
    low, high : ends of the confidence interval, 95 % by default. It is valid for starts that were not used to
        choose the design.
    converged : whether Eq. 8.1 was met.
    reason : "" or why the design failed.

    std, low and high are NaN if not known, and for failed designs.
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
        """Whether all starts of the design are known to give the same value; equal values alone do not prove
        it."""
        return self.starts == 1 and self.std == 0

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
        cls, objective: Objective, values: ArrayLike, converged: bool, others: Others = NO_OTHERS,
        confidence: float = CONFIDENCE,
    ) -> FitnessEstimate:  # fmt: skip
        """Return the estimate of an objective's cost from the values of each start; at least one.

        values : shape (starts, quantities).
        others : further costs that may occur, even if all starts gave equal ones, and the skewness of the
            costs.
        confidence : of the interval.
        """
        costs, statistic = objective.costs(values), objective.statistic_of_costs
        n = len(costs)
        std = float(np.std(statistic.pseudo_values(costs), ddof=1)) if n > 1 else math.nan
        low, high = statistic.interval(costs, others, confidence)
        return cls(statistic.value(costs), std, low, high, n, converged)

    @classmethod
    def certain(cls, value: float) -> FitnessEstimate:
        """Return the estimate of a design whose starts are all the same."""
        return cls(value, 0.0, value, value, 1, True)

    @classmethod
    def failed(cls, starts: int, reason: str) -> FitnessEstimate:
        """Return the estimate of a design with a failed run, or without a valid scene."""
        return cls(math.inf, math.nan, math.nan, math.nan, starts, False, reason)


def converged_after(costs: ArrayLike, tolerance: float, min_starts: int) -> int | None:
    """Return the least number of starts n = E + 1 >= min_starts that meets Z04 Eq. 8.1, or None.

        |mean_n - mean_E| < TOL |mean_n|

    costs : the mean of the first 1, 2, ... starts, shape (starts,) or (starts, objectives); all objectives
        must meet the equation at the same n. Two equal means count as converged, also if both are zero.
    """
    numbers = np.asarray(costs, dtype=float)
    means = numbers.reshape(len(numbers), -1)
    for n in range(max(min_starts, 2), len(means) + 1):
        change = np.abs(means[n - 1] - means[n - 2])
        if np.all((change == 0) | (change < tolerance * np.abs(means[n - 1]))):
            return n
    return None


def may_occur(costs: NDArray[np.float64], seen: Sequence[float], most: float) -> Sequence[float]:
    """Return the costs that may occur for a design whose own costs are all equal.

    They are the two ends of a range: at most ``most`` from the design's cost, the largest difference between
    starts of one design, and within the costs ``seen`` of all designs. If no starts have differed, a rare
    cost may lie on either side, as far off as the costs of all designs are from each other: the least cost
    seen is no bound for it. If fewer than three costs are known, ``seen`` itself is returned.
    """
    if len(seen) < 3:
        return seen
    if not most:
        spread = seen[-1] - seen[0]
        return float(costs[0]) - spread, float(costs[0]) + spread
    return max(seen[0], float(costs[0]) - most), min(seen[-1], float(costs[0]) + most)
