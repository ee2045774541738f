"""Confidence intervals of the mean of few, skewed or nearly equal values."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.stats import binom
from scipy.stats import t as student

from tisim.numerics.statistics import CONFIDENCE


def interval(
    values: ArrayLike, support: ArrayLike = (), confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return the ends of the confidence interval of the mean of independent values, shape (n,).

    Student's t, corrected for the skewness of the values by the cubic transformation of P. Hall, J. R. Stat.
    Soc. B 54 (1992) 221-228. Two kinds of values have a rule of their own:

    - Where no more than two different values are known, the interval is that of a binomial share, by mid-P
      (H. O. Lancaster, J. Am. Stat. Assoc. 56 (1961) 223-234). Twelve equal values leave a share of 0.22 for
      another one.
    - Equal values otherwise tell nothing of what the rarer ones are; they are taken to be anywhere between
      the ends of ``support``.

    support : values that are known to occur, for instance in other samples, or ends of the range. (NaN, NaN)
    where no interval is known: for one value, and for equal values when no other value is known.
    """
    sample = np.asarray(values, dtype=float)
    known = np.unique(np.concatenate([sample, np.ravel(support)]))
    n, mean = len(sample), float(np.mean(sample))
    if n < 2 or len(known) == 1:
        return math.nan, math.nan
    low, high = float(known[0]), float(known[-1])
    if len(known) == 2 or np.ptp(sample) == 0:
        if len(known) == 2:
            ends = _binomial_share(round(n * (mean - low) / (high - low)), n, confidence)
            return low + ends[0] * (high - low), low + ends[1] * (high - low)
        rare = _binomial_share(0, n, confidence)[1]
        return mean - rare * (mean - low), mean + rare * (high - mean)
    deviation = float(np.std(sample, ddof=1))
    skewness = float(np.mean((sample - mean) ** 3)) / float(np.std(sample)) ** 3
    quantile = float(student.ppf(0.5 + confidence / 2, n - 1)) / math.sqrt(n)
    return (
        mean - deviation * _transformed_back(quantile, skewness, n),
        mean - deviation * _transformed_back(-quantile, skewness, n),
    )


def _binomial_share(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Return the ends of the interval of a probability, at which the mid-P of both tails is equal."""
    tail = 0.5 - confidence / 2

    def end(count: int) -> float:
        """Where no more than ``count`` successes have the probability of the tail, half of that of ``count``
        itself taken off."""
        return float(
            brentq(lambda p: binom.cdf(count, trials, p) - binom.pmf(count, trials, p) / 2 - tail, 0.0, 1.0)
        )

    low = 0.0 if successes == 0 else 1.0 - end(trials - successes)
    high = 1.0 if successes == trials else end(successes)
    return low, high


def _transformed_back(y: float, skewness: float, n: int) -> float:
    """Return x with x + g x^2 / 3 + g^2 x^3 / 27 + g / 6 n = y (Hall 1992, T = (mean - mu) / s = x)."""
    if abs(skewness) < 1e-8:
        return y
    return float((np.cbrt(1.0 + skewness * (y - skewness / (6.0 * n))) - 1.0) / (skewness / 3.0))
