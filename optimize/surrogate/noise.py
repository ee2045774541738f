"""What the runs of a search tell of the shape of their noise, though each design has had two or so."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.belief import MOST_LEARNED, costs_and_noise
from tisim.optimize.surrogate.gaussian_process import Array, GaussianProcess
from tisim.optimize.surrogate.selection import representative

from tisim.numerics.skewed import Moments

LEAST_DESIGNS = 10
"""Designs with several starts below which nothing is told."""


def moments(genome: Genome, strings: Sequence[Individual]) -> tuple[Moments, ...] | None:
    """Return the moments of the noise of each cost; None where too few designs have several starts.

    Two values of a design do not tell in which direction noise is skewed: (0, 20) may be 20 too much once, or
    20 too little. Other designs tell whether their mean is too high. Of a mean of n values and their variance
    s^2 the covariance is k_3 / n, k_3 being the third central moment (M. G. Kendall and A. Stuart, The
    Advanced Theory of Statistics, vol. 1, 4th ed. (1977), section 12.3): so k_3 is the mean over designs of
    n s^2 times how far the mean is from what a Gaussian process predicts of it from all others. It counts for
    fewer values, the more the process misses beside noise. The starts of a design must be its own.
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
    """Return how far each cost is from what the others predict of it, less the mean of this."""
    if not np.any(noise):
        return np.zeros(len(costs))
    missed = GaussianProcess(features, costs, noise).left_out()
    return missed - missed.mean()
