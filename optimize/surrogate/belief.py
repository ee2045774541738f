"""What a search believes of designs that it has not run: a Gaussian process for each cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import yeojohnson
from tisim.optimize.methods.individual import Individual
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess, Parameters
from tisim.optimize.surrogate.selection import representative, thinned

MOST_LEARNED = 500
"""Designs from which a process is made, at most."""
_PRIOR_STARTS = 8
"""Starts that the noise of all designs together counts for beside the starts of the design itself."""
_SKEWED, _SKEWED_NOISE = 0.5, 2.0
"""Skewness of costs above which they are transformed, without and with noise: a few large ones would hide all
differences between small ones. But the mean of noisy costs is not that of transformed ones."""


class Belief:
    """A belief holds a Gaussian process for each cost, in units that ``transformed`` gives.

    features : of points of the unit cube, (n, genes) -> (n, features).
    The noise of the mean of n starts is the variance of those starts over n. The variance of a single design,
    known from two starts or so, is drawn towards that of all designs; that of a value that came with its
    standard error is known. Where no design has more than one start, noise is what the nugget of the process
    makes of the values. A failed design has the worst cost. exact : whether it is known that there is no
    noise.
    """

    def __init__(self, features: Callable[[Array], Array] = np.asarray) -> None:
        self.features = features
        self.models: list[GaussianProcess] = []
        self._parameters: list[Parameters | None] = []
        self.starts = 1

    def learn(self, strings: Sequence[Individual], iterations: int = 30, apart: float = 0.0) -> None:
        """Learn from strings of known fitness, of which one or more has not failed.

        apart : of designs that are closer together in all genes the process is made of the best alone, where
        there is one cost and no noise. Many equal ones at a place make it think that nothing changes.
        """
        self.strings = list(strings)
        self.points = np.array([list(string) for string in strings])
        costs, self.noise = costs_and_noise(strings)
        self.exact = all_exact(strings)
        self.starts = int(np.median([string.estimates[0].starts for string in strings])) or 1
        self.costs, slopes = _transformed(costs, _SKEWED if self.exact else _SKEWED_NOISE)
        alone = np.arange(len(costs))
        if apart and self.exact and costs.shape[1] == 1:
            alone = thinned(self.points, costs[:, 0], apart)
        chosen = alone[representative(costs[alone], MOST_LEARNED, self.exact)]
        self.chosen = chosen
        variances = self.noise * slopes**2
        self.one_start = np.array([_pooled(strings, k) for k in range(costs.shape[1])]) * np.mean(
            slopes[chosen] ** 2, axis=0
        )
        at = self.features(self.points[chosen])
        starts = self._parameters or [None] * costs.shape[1]
        self.models = [
            GaussianProcess(
                at, cost[chosen], variance[chosen], start=start, iterations=iterations, exact=self.exact
            )
            for cost, variance, start in zip(self.costs.T, variances.T, starts, strict=True)
        ]
        self._parameters = [model.parameters for model in self.models]

    @property
    def means(self) -> Array:
        """The posterior mean of each cost of the designs it is made of, (chosen, objectives); without noise,
        the costs themselves: what the process smooths away is there, though it cannot tell where."""
        if self.exact:
            return self.costs[self.chosen]
        return self.predict(self.points[self.chosen])[0]

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of each cost at points of the unit cube, (m, objectives)."""
        at = self.features(np.atleast_2d(points))
        means, deviations = zip(*(model.predict(at) for model in self.models), strict=True)
        return np.column_stack(means), np.column_stack(deviations)


def all_exact(strings: Sequence[Individual]) -> bool:
    """Return whether all costs of the strings that have not failed are known to have no noise."""
    return all(one.exact for string in strings if not string.failed for one in string.estimates)


def costs_and_noise(strings: Sequence[Individual]) -> tuple[Array, Array]:
    """Return the costs of strings and the variances of these means, both (strings, objectives)."""
    costs = np.array([string.fitness.values for string in strings], dtype=float)
    good = np.all(np.isfinite(costs), axis=1)
    for column in costs.T:
        column[~good] = column[good].max()
    noise = np.empty_like(costs)
    for k in range(costs.shape[1]):
        pooled = _pooled(strings, k)
        for i, string in enumerate(strings):
            estimate = string.estimates[k]
            n, known = max(estimate.starts, 1), math.isfinite(estimate.std)
            if n == 1 and known:
                noise[i, k] = estimate.std**2
                continue
            own = estimate.std**2 if known else pooled
            noise[i, k] = (_PRIOR_STARTS * pooled + (n - 1) * own) / (_PRIOR_STARTS + n - 1) / n
    return costs, noise


def _pooled(strings: Sequence[Individual], objective: int) -> float:
    """Return the variance of a cost from start to start, of all designs together: where no design has two
    starts, the mean of those that came with their standard errors; 0 where it is not known."""
    known = [string.estimates[objective] for string in strings]
    known = [estimate for estimate in known if estimate.ok and math.isfinite(estimate.std)]
    squares, freedom = 0.0, 0
    for estimate in known:
        if estimate.starts > 1:
            squares += (estimate.starts - 1) * estimate.std**2
            freedom += estimate.starts - 1
    if not freedom and known:
        return float(np.mean([estimate.std**2 for estimate in known]))
    return squares / freedom if freedom else 0.0


def _transformed(costs: Array, skewed: float) -> tuple[Array, Array]:
    """Return costs in units in which they are less skewed to large values than that, and the unit's slope.

    I.-K. Yeo and R. A. Johnson, Biometrika 87 (2000) 954-959. Other columns are returned as they are.
    """
    new, slopes = costs.copy(), np.ones_like(costs)
    for k, column in enumerate(costs.T):
        deviation = column.std()
        z = (column - column.mean()) / (deviation or 1.0)
        if np.mean(z**3) < skewed:
            continue
        new[:, k], power = yeojohnson(z)
        slopes[:, k] = np.where(
            z < 0, (1 - np.minimum(z, 0)) ** (1 - power), (1 + np.maximum(z, 0)) ** (power - 1)
        )
        slopes[:, k] /= deviation
    return new, slopes
