"""Predictions for designs that have not run: a Gaussian process for each cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import yeojohnson

from tisim.optimize.methods.individual import Individual
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess, Parameters
from tisim.optimize.surrogate.noise import all_exact, costs_and_noise, pooled_variance
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative, thinned
from tisim.optimize.surrogate.validity import Validity

_SKEWED, _SKEWED_NOISE = 0.5, 2.0
"""Costs with a larger skewness than this, without and with noise, are transformed: otherwise a few large
costs would hide all differences between small ones. With noise the limit is higher, because the mean of noisy
costs is not the mean of transformed ones."""
_DECADES = 1e4
"""Costs without noise whose range is larger than this, over the distance of their median from the least cost,
are compressed first: penalties of 1e12, or a cost that grows exponentially, would leave all good designs
equal to the last digit."""
_WORST = 4.0
"""Largest compressed cost, in the distance of the median from the least cost. Designs beyond it count as
equally bad, so that no cliff of the cost hides the slope beside it."""


class Belief:
    """A Gaussian process for each cost, in units given by ``_transformed``.

    features : function of points of the unit cube, (n, genes) -> (n, features).
    exact : whether the costs are known to have no noise.

    The noise of a mean over n starts is the variance between starts divided by n. The variance of a single
    design, known from about two starts, is shrunk towards the pooled variance of all designs. A value given
    with its standard error keeps it. If no design has more than one start, the nugget of the process
    represents the noise. The costs are learned from the designs that did not fail; the others determine
    ``validity``, which is None if none has failed.
    """

    def __init__(self, features: Callable[[Array], Array] = np.asarray) -> None:
        self.features = features
        self.models: list[GaussianProcess] = []
        self._parameters: list[Parameters | None] = []
        self.validity: Validity | None = None
        self.starts = 1

    def learn(self, individuals: Sequence[Individual], iterations: int = 30, apart: float = 0.0) -> None:
        """Fit the processes to individuals of known fitness, at least one of which did not fail.

        apart : with one cost and no noise, only the best of designs that are closer than this in all genes is
            used; a cluster of almost equal designs would make the function appear constant.
        """
        self._learn_validity(individuals)
        individuals = [individual for individual in individuals if not individual.failed]
        self.individuals = list(individuals)
        self.points = np.array([list(individual) for individual in individuals])
        costs, self.noise = costs_and_noise(individuals)
        self.exact = all_exact(individuals)
        self.starts = int(np.median([individual.estimates[0].starts for individual in individuals])) or 1
        self.costs, slopes = _transformed(costs, self.exact)
        alone = np.arange(len(costs))
        if apart and self.exact and costs.shape[1] == 1:
            alone = thinned(self.points, costs[:, 0], apart)
        chosen = alone[representative(costs[alone], MOST_LEARNED, self.exact)]
        self.chosen = chosen
        variances = self.noise * slopes**2
        self.one_start = np.array([pooled_variance(individuals, k) for k in range(costs.shape[1])]) * np.mean(
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

    def _learn_validity(self, individuals: Sequence[Individual]) -> None:
        failed = np.array([individual.failed for individual in individuals])
        if failed.any():
            points = np.array([list(individual) for individual in individuals])
            start = None if self.validity is None else self.validity.model.parameters
            self.validity = Validity(self.features, points, failed, start)

    def log_valid(self, points: Array) -> Array | None:
        """Return the logarithm of the probability that designs do not fail, (m,); None if none has failed."""
        return None if self.validity is None else self.validity.log_probability(points)

    @property
    def means(self) -> Array:
        """The posterior mean of each cost of the fitted designs, (chosen, objectives).

        Without noise these are the costs themselves, because variations that the process smooths are real.
        """
        if self.exact:
            return self.costs[self.chosen]
        return self.predict(self.points[self.chosen])[0]

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of each cost at points of the unit cube, (m, objectives)."""
        at = self.features(np.atleast_2d(points))
        means, deviations = zip(*(model.predict(at) for model in self.models), strict=True)
        return np.column_stack(means), np.column_stack(deviations)


def _compressed(costs: Array) -> tuple[Array, Array]:
    """Return costs of one objective, (n,), without their largest decades, and the slope of the new unit.

    With the least cost l and the median m, a cost c becomes (m - l) min(log(1 + (c - l) / (m - l)), 4). If
    most costs are penalties, m is the quantile 0.2.
    """
    above = costs - costs.min()
    fifth, spread = np.quantile(above, (0.2, 0.5), method="lower")
    if spread > _DECADES * fifth > 0:
        # More than half of the designs have a penalty.
        spread = fifth
    if not spread or above.max() <= _DECADES * spread:
        return costs, np.ones_like(costs)
    with np.errstate(divide="ignore"):
        logarithm = np.logaddexp(0.0, np.log(above) - np.log(spread))
    return spread * np.minimum(logarithm, _WORST), spread / (spread + above)


def _transformed(costs: Array, exact: bool) -> tuple[Array, Array]:
    """Return costs in units in which they are less skewed, and the slope of the unit.

    Columns with a small skewness are returned unchanged.

    Source: I.-K. Yeo and R. A. Johnson, Biometrika 87 (2000) 954-959.
    """
    skewed = _SKEWED if exact else _SKEWED_NOISE
    new, slopes = costs.copy(), np.ones_like(costs)
    for k in range(costs.shape[1]):
        if exact:
            new[:, k], slopes[:, k] = _compressed(costs[:, k])
        column = new[:, k].copy()
        deviation = column.std()
        z = (column - column.mean()) / (deviation or 1.0)
        if np.mean(z**3) < skewed:
            continue
        new[:, k], power = yeojohnson(z)
        slopes[:, k] *= np.where(
            z < 0, (1 - np.minimum(z, 0)) ** (1 - power), (1 + np.maximum(z, 0)) ** (power - 1)
        )
        slopes[:, k] /= deviation
    return new, slopes
