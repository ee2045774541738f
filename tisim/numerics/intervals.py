"""Confidence intervals of a quantile, and of the mean squared deviation from measured values."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.stats import binom, chi2, ncx2
from scipy.stats import t as student

from tisim.numerics.statistics import CONFIDENCE

Array = NDArray[np.float64]

_NODES = (np.arange(64) + 0.5) / 64
"""Probabilities at which the distribution of an estimated variance is sampled."""
_FAR = 1e4
"""Squared distance, in variances of the means, beyond which Student's t is used for the distance itself."""


def of_quantile(values: ArrayLike, share: float, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the confidence interval of a quantile of independent values, shape (n,).

    The ends are order statistics, interpolated to the requested confidence (J. Nyblom, Statist. Probab. Lett.
    14 (1992) 129-131). An end for which there are too few values is NaN.
    """
    ordered = np.sort(np.asarray(values, dtype=float))
    return _low_end(ordered, share, confidence), -_low_end(-ordered[::-1], 1.0 - share, confidence)


def fewest_of_quantile(share: float, confidence: float = CONFIDENCE) -> int:
    """Return the number of values from which the interval of a quantile has both ends."""
    return math.ceil(math.log(0.5 - confidence / 2) / math.log(max(share, 1.0 - share)))


def _low_end(ordered: Array, share: float, confidence: float) -> float:
    n, wanted = len(ordered), 0.5 + confidence / 2
    below = binom.sf(np.arange(n), n, share)  # probability that the (r+1)-th value is below the quantile
    if n == 0 or below[0] < wanted:
        return math.nan
    k = int(np.flatnonzero(below >= wanted)[-1])
    if k == n - 1 or below[k] == wanted:
        return float(ordered[k])
    r = k + 1
    odds = r * (1 - share) * (wanted - below[k + 1]) / ((n - r) * share * (below[k] - wanted))
    part = 1.0 / (1.0 + odds)
    return float((1 - part) * ordered[k] + part * ordered[k + 1])


def of_squared_distance(off: ArrayLike, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the confidence interval of |mu|^2 / K, the mean of the squares of K expectations mu.

    off : shape (n, K), n > 1 independent values with the expectations mu.

    |mean|^2 is approximated by c times a noncentral chi^2 with nu degrees of freedom; c and nu follow from
    its first two moments (F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110-114). As c is itself an
    estimate, with n - 1 or more degrees of freedom, the distribution is averaged over c; for one quantity the
    result is Student's interval.
    """
    sample = np.asarray(off, dtype=float)
    n, count = sample.shape
    mean, covariance = sample.mean(axis=0), np.atleast_2d(np.cov(sample.T)) / n
    trace, squares = float(np.trace(covariance)), float(np.sum(covariance**2))
    total = float(mean @ mean)
    if trace == 0.0:
        return total / count, total / count
    distance = max(total - trace, 0.0)
    along = max(float(mean @ covariance @ mean) - squares, 0.0)
    c = (squares + 2.0 * along) / (trace + 2.0 * distance)
    freedom, far = trace / c, 2.0 * distance / (trace + 2.0 * distance)
    of_variance = (n - 1) * ((1.0 - far) * trace**2 / squares + far)
    ratio = total / c
    if ratio > _FAR:
        half = float(student.ppf(0.5 + confidence / 2, of_variance))
        return c * (math.sqrt(ratio) - half) ** 2 / count, c * (math.sqrt(ratio) + half) ** 2 / count
    weights = chi2.ppf(_NODES, of_variance) / of_variance

    def excess(noncentrality: float, probability: float) -> float:
        return float(np.mean(ncx2.cdf(ratio * weights, freedom, noncentrality * weights))) - probability

    def end(probability: float) -> float:
        if excess(0.0, probability) <= 0.0:
            return 0.0
        top = ratio + 10.0
        while excess(top, probability) > 0.0:
            top *= 2.0
        return c * float(brentq(excess, 0.0, top, args=(probability,))) / count

    return end(0.5 + confidence / 2), end(0.5 - confidence / 2)
