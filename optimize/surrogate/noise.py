"""Skewness of the noise of runs, estimated from all designs, although each has only about two starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tisim.numerics.skewed import Moments
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import MOST_LEARNED, costs_and_noise
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess
from tisim.optimize.surrogate.selection import representative

LEAST_DESIGNS = 10
"""Smallest number of designs with several starts for an estimate."""


def moments(genome: Genome, strings: Sequence[Individual]) -> tuple[Moments, ...] | None:
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
    several = [one for one in strings if not one.failed and one.estimates[0].starts > 1]
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
    missed = GaussianProcess(features, costs, noise).left_out()
    return missed - missed.mean()
