"""The noise of costs: the variance of a mean of few starts, and the skewness estimated from all designs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tisim.numerics.skewed import Moments
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative

_PRIOR_STARTS = 8
"""Weight, in starts, of the pooled noise of all designs relative to the starts of a single design."""
LEAST_DESIGNS = 10
"""Smallest number of designs with several starts for an estimate."""


def all_exact(individuals: Sequence[Individual]) -> bool:
    """Return whether all costs of the individuals that did not fail are known to have no noise."""
    return all(
        one.exact for individual in individuals if not individual.failed for one in individual.estimates
    )


def costs_and_noise(individuals: Sequence[Individual]) -> tuple[Array, Array]:
    """Return the costs of individuals and the variances of these means, both (individuals, objectives)."""
    costs = np.array([individual.fitness.values for individual in individuals], dtype=float)
    good = np.all(np.isfinite(costs), axis=1)
    for column in costs.T:
        column[~good] = column[good].max()
    noise = np.empty_like(costs)
    for k in range(costs.shape[1]):
        pooled = pooled_variance(individuals, k)
        for i, individual in enumerate(individuals):
            estimate = individual.estimates[k]
            n, known = max(estimate.starts, 1), math.isfinite(estimate.std)
            if n == 1 and known:
                noise[i, k] = estimate.std**2
                continue
            own = estimate.std**2 if known else pooled
            noise[i, k] = (_PRIOR_STARTS * pooled + (n - 1) * own) / (_PRIOR_STARTS + n - 1) / n
    return costs, noise


def pooled_variance(individuals: Sequence[Individual], objective: int) -> float:
    """Return the variance of a cost between starts, pooled over all designs.

    If no design has two starts, it is the mean of the given squared standard errors; 0 if there are none.
    """
    known = [individual.estimates[objective] for individual in individuals]
    known = [estimate for estimate in known if estimate.ok and math.isfinite(estimate.std)]
    squares, freedom = 0.0, 0
    for estimate in known:
        if estimate.starts > 1:
            squares += (estimate.starts - 1) * estimate.std**2
            freedom += estimate.starts - 1
    if not freedom and known:
        return float(np.mean([estimate.std**2 for estimate in known]))
    return squares / freedom if freedom else 0.0


def moments(genome: Genome, individuals: Sequence[Individual]) -> tuple[Moments, ...] | None:
    """Return the moments of the noise of each cost; None if too few designs have several starts.

    The two values of one design do not show the direction of skewness: in (0, 20) either value may be the
    outlier. Other designs show whether the mean is too high. The mean of n values and their variance s^2 have
    the covariance k_3 / n, with k_3 the third central moment. Hence k_3 is estimated as the mean over designs
    of n s^2 times the deviation of the mean from the prediction of a Gaussian process of all other designs.
    The estimate is given a smaller weight if the prediction errors exceed the noise. The starts of a design
    must be its own.

    Source: M. G. Kendall and A. Stuart, The Advanced Theory of Statistics, vol. 1, 4th ed. (1977), section
    12.3.
    """
    several = [one for one in individuals if not one.failed and one.estimates[0].starts > 1]
    several = [one for one in several if all(math.isfinite(estimate.std) for estimate in one.estimates)]
    if len(several) < LEAST_DESIGNS:
        return None
    costs = np.array([[estimate.mean for estimate in one.estimates] for one in several])
    _, noise = costs_and_noise(several)
    chosen = representative(costs, MOST_LEARNED, exact=False)
    features = genome.features(genome.canonical([list(several[i]) for i in chosen]))
    starts = np.array([float(several[i].estimates[0].starts) for i in chosen])
    found = []
    for k in range(costs.shape[1]):
        variance = np.array([several[i].estimates[k].std ** 2 for i in chosen])
        missed = _missed(features, costs[chosen, k], noise[chosen, k])
        second = float(np.average(variance, weights=starts - 1.0))
        third = float(np.mean(starts * variance * missed))
        part = min(float(np.mean(variance / starts)) / (float(np.mean(missed**2)) or 1.0), 1.0)
        found.append(Moments(second, third, part * float(starts.sum())))
    return tuple(found)


def _missed(features: Array, costs: Array, noise: Array) -> Array:
    """Return the leave-one-out residual of each cost, minus the mean of these residuals."""
    if not np.any(noise):
        return np.zeros(len(costs))
    missed, _ = GaussianProcess(features, costs, noise).left_out()
    return missed - missed.mean()
