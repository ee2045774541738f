"""Confidence intervals of the mean of few, skewed or nearly equal values."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.stats import binom
from scipy.stats import t as student

from tisim.numerics.statistics import CONFIDENCE


@dataclass(frozen=True)
class Moments:
    """Unbiased second and third central moments of the noise of values, and the number of values."""

    second: float
    third: float
    count: float

    @property
    def skewness(self) -> float:
        """The skewness; 0 if all values are equal."""
        return self.third / self.second**1.5 if self.second > 0 else 0.0

    def __add__(self, other: Moments) -> Moments:
        """Return the moments of both sets of values together."""
        count = self.count + other.count
        second = self.count * self.second + other.count * other.second
        third = self.count * self.third + other.count * other.third
        return Moments(second / count, third / count, count)

    @classmethod
    def of(cls, values: ArrayLike) -> Moments:
        """Return the moments of three or more independent values.

        They are Fisher's k-statistics (M. G. Kendall and A. Stuart, The Advanced Theory of Statistics, vol.
        1, 4th ed. (1977), section 12.9).
        """
        sample = np.asarray(values, dtype=float)
        n = len(sample)
        off = sample - sample.mean()
        second, third = float(np.sum(off**2)) / (n - 1), float(np.sum(off**3)) * n / ((n - 1) * (n - 2))
        return cls(second, third, float(n))


def interval(
    values: ArrayLike,
    support: ArrayLike = (),
    skewness: float | None = None,
    confidence: float = CONFIDENCE,
) -> tuple[float, float]:
    """Return the confidence interval of the mean of independent values, shape (n,).

    It is Student's t, corrected for the skewness of the values by the cubic transformation of P. Hall, J. R.
    Stat. Soc. B 54 (1992) 221-228. Two kinds of samples have their own rules:

    - If at most two different values are known, the interval is a binomial proportion by mid-P (H. O.
      Lancaster, J. Am. Stat. Assoc. 56 (1961) 223-234). After twelve equal values the other one may have a
      share of up to 0.22.
    - Equal values otherwise carry no information on the rarer values, which are assumed to lie anywhere
      between the ends of ``support``.

    support : values known to occur, for instance in other samples, or ends of the range.
    skewness : skewness to correct for, if it is known better than from these values (see
    ``shared_skewness``).

    Returns (NaN, NaN) if no interval is known: for a single value, and for equal values if no other value is
    known.
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
    if skewness is None:
        skewness = sample_skewness(sample)
    quantile = float(student.ppf(0.5 + confidence / 2, n - 1)) / math.sqrt(n)
    return (
        mean - deviation * _transformed_back(quantile, skewness, n),
        mean - deviation * _transformed_back(-quantile, skewness, n),
    )


def sample_skewness(values: ArrayLike) -> float:
    """Return the skewness of the given values, which underestimates the skewness of their distribution; 0 for
    equal values."""
    sample = np.asarray(values, dtype=float)
    off = sample - sample.mean()
    deviation = math.sqrt(float(np.mean(off**2)))
    return float(np.mean(off**3)) / deviation**3 if deviation > 0 else 0.0


def shared_skewness(samples: Sequence[ArrayLike], others: Moments | None = None) -> float | None:
    """Return the skewness that corrects the intervals of several samples with similar noise.

    A dozen values often contain no rare value, although other samples do. The moments of all samples, and of
    ``others``, are therefore combined. The skewness of the distribution would correct too much for a small
    sample, whose deviation grows with its mean; samples of n values use 1 - 1.1 / sqrt(n) of it. This factor
    gives the most even coverage of the mean over normal, exponential, lognormal and chi-square noise and rare
    events (tests/numerics/test_skewed.py). Its magnitude is at least the mean skewness of the samples
    themselves.

    None for a single sample without ``others``.
    """
    large = [one for one in map(np.asarray, samples) if len(one) > 2]
    if not large or (len(large) == 1 and others is None):
        return None
    together = functools.reduce(operator.add, map(Moments.of, large))
    if others is not None:
        together += others
    n = float(np.mean([len(one) for one in large]))
    shared = (1.0 - 1.1 / math.sqrt(n)) * together.skewness
    own = float(np.mean([sample_skewness(one) for one in large]))
    return shared if abs(shared) >= abs(own) else own


def _binomial_share(successes: int, trials: int, confidence: float) -> tuple[float, float]:
    """Return the interval of a probability, at whose ends the mid-P of both tails is equal."""
    tail = 0.5 - confidence / 2

    def end(count: int) -> float:
        """Return the probability p at which the mid-P of at most ``count`` successes equals the tail.

        The mid-P is the probability of at most ``count`` successes less half of the probability of exactly
        ``count``.
        """
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
