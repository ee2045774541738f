"""Fitness averaged over random starts, and when the average has converged (Z04 Eq. 8.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tisim.numerics.statistics import half_width


@dataclass(frozen=True)
class FitnessEstimate:
    """Fitness of one design.

    mean : of the first `starts` starts, +inf if the design failed. std : sample standard deviation.
    half_width : of the 95 % confidence interval of the mean (Student t; the stopping rule's own effect on
    coverage is not corrected for). converged : Eq. 8.1 was met. reason : "" or why the design failed.
    std and half_width are NaN for fewer than two starts and for failed designs.
    """

    mean: float
    std: float
    half_width: float
    starts: int
    converged: bool
    reason: str = ""

    @property
    def ok(self) -> bool:
        return not self.reason

    @classmethod
    def of(cls, values: Sequence[float], converged: bool) -> FitnessEstimate:
        """Return the estimate from the fitness of each start; at least one."""
        n = len(values)
        mean = float(np.cumsum(values)[-1] / n)  # summed as in converged_after, to the last bit
        std = float(np.std(values, ddof=1)) if n > 1 else math.nan
        unsure = float(half_width(values)) if n > 1 else math.nan
        return cls(mean, std, unsure, n, converged)


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
